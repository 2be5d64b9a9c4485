//! Mesa's layer that sorts devices. It looks for a Wayland display, and complains on standard error
//! where there is none.

/// The environment in which the layer does nothing.
#[cfg(unix)]
const OFF: (&str, &str) = ("NODEVICE_SELECT", "1");

/// Starts the program anew with the layer switched off, where it is not. The layer reads the
/// environment, which a program cannot safely change under itself. Returns where that was done, is
/// of no use, or fails.
pub(crate) fn without_mesas_layer() {
    #[cfg(unix)]
    if std::env::var_os(OFF.0).is_none()
        && let Ok(program) = std::env::current_exe()
    {
        use std::os::unix::process::CommandExt;
        let mut arguments = std::env::args_os();
        let mut command = std::process::Command::new(program);
        if let Some(name) = arguments.next() {
            command.arg0(name);
        }
        // Only comes back if it fails; then there are two lines too many.
        let _ = command.args(arguments).env(OFF.0, OFF.1).exec();
    }
}
