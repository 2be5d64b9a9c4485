//! Links libc, for the memory functions that the compiler calls.
fn main() {
    println!("cargo:rustc-link-arg-bins=-lc");
}
