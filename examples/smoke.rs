//! Smoke.
use glam::*;
use shadow_warp::*;
fn main() -> Result<(), Error> {
    let view = View::perspective(dvec3(0., 10., 0.), dvec3(0., 0., 1.), DVec3::Y, 60f64.to_radians(), 1., 1.0..400.)?;
    let light = Light::directional(dvec3(0., 1., 0.))?;
    let b = Bounds::new(dvec3(-200., 0., 0.), dvec3(200., 50., 400.))?;
    let seen = [Body::visible(&view, &b)];
    println!(
        "V {} E {} F {} vol {}",
        seen[0].vertices().len(),
        seen[0].edges().count(),
        seen[0].faces().count(),
        seen[0].volume()
    );
    let fit = Fit { viewport: [512, 512], ..Fit::new(&view, &light, &b, &seen) };
    for r in [Rule::Uniform, Rule::LISPSM, Rule::LightSpace(LightSpaceRule::Extent)] {
        let m = fit.solve(r)?;
        println!("{:?} {} worst {}", r, m.warp().ratio(), fit.worst_texel(&m));
        let c = m.clip_from_world(ClipSpace::WGPU);
        let mut lo = DVec3::MAX;
        let mut hi = DVec3::MIN;
        for v in seen[0].vertices() {
            let p = c.project_point3(*v + seen[0].origin());
            lo = lo.min(p);
            hi = hi.max(p);
        }
        println!("{lo} {hi} det {}", c.determinant());

        let cb = seen[0].casters(&light, &b)?;
        let mut lo = DVec3::MAX;
        let mut hi = DVec3::MIN;
        println!("{} {} {}", cb.vertices().len(), cb.edges().count(), cb.faces().count());
        for v in cb.vertices() {
            let p = c.project_point3(*v + cb.origin());
            lo = lo.min(p);
            hi = hi.max(p);
        }
        println!("casters {lo} {hi}");
        println!("rounding {:?} {:?}", fit.rounding(&m, view.eye()), fit.rounding(&m, dvec3(1e7, 0., 0.)));
        fit.guard_f32(&m, view.eye())?;
    }
    Ok(())
}
