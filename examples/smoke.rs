//! cg
#[path = "../benches/cases/mod.rs"]
mod cases;
use shadow_warp::*;
use std::hint::black_box;
#[inline(never)]
fn view(j: &cases::Job) -> View {
    j.view().unwrap()
}
#[inline(never)]
fn clip(v: &View, b: &Bounds) -> Body {
    Body::visible(v, b)
}
#[inline(never)]
fn fit(v: &View, l: &Light, b: &Bounds, s: &[Body], r: Rule) -> Result<ShadowMap, Error> {
    Fit::new(v, l, b, s).solve(r)
}
#[inline(never)]
fn worst(v: &View, l: &Light, b: &Bounds, s: &[Body], m: &ShadowMap) -> f64 {
    Fit::new(v, l, b, s).worst_texel(m)
}
#[inline(never)]
fn casters(l: &Light, b: &Bounds, s: &Body) -> CasterBody {
    s.casters(l, b).unwrap()
}
#[inline(never)]
fn whole(j: &cases::Job) -> Result<ShadowMap, Error> {
    let v = j.view()?;
    let l = j.light()?;
    let s = [Body::visible(&v, &j.bounds)];
    Fit::new(&v, &l, &j.bounds, &s).solve(Rule::LISPSM)
}
fn main() {
    let jobs = cases::jobs();
    let mut nv = 0;
    let mut acc = 0.;
    for j in &jobs {
        let v = view(j);
        let l = j.light().unwrap();
        let s = [clip(&v, &j.bounds)];
        nv += s[0].vertices().len();
        let m = fit(&v, &l, &j.bounds, &s, Rule::LISPSM).unwrap();
        acc += worst(&v, &l, &j.bounds, &s, &m);
        black_box(casters(&l, &j.bounds, &s[0]));
        black_box(whole(j)).unwrap();
    }
    println!("{} {}", nv as f64 / 1000., acc);
    if std::env::args().nth(1).is_some() {
        use std::time::Instant;
        let vs: Vec<_> = jobs.iter().map(|j| (view(j), j.light().unwrap())).collect();
        let bs: Vec<_> = jobs.iter().zip(&vs).map(|(j, v)| [clip(&v.0, &j.bounds)]).collect();
        let mut best = [f64::MAX; 4];
        for _ in 0..300 {
            let t = Instant::now();
            for (j, v) in jobs.iter().zip(&vs) {
                black_box(clip(&v.0, &j.bounds));
            }
            best[0] = best[0].min(t.elapsed().as_nanos() as f64 / 1000.);
            let t = Instant::now();
            for ((j, v), b) in jobs.iter().zip(&vs).zip(&bs) {
                let _ = black_box(fit(&v.0, &v.1, &j.bounds, b, Rule::LISPSM));
            }
            best[1] = best[1].min(t.elapsed().as_nanos() as f64 / 1000.);
            let t = Instant::now();
            for j in &jobs {
                let _ = black_box(whole(j));
            }
            best[2] = best[2].min(t.elapsed().as_nanos() as f64 / 1000.);
            let t = Instant::now();
            for ((j, v), b) in jobs.iter().zip(&vs).zip(&bs) {
                black_box(casters(&v.1, &j.bounds, &b[0]));
            }
            best[3] = best[3].min(t.elapsed().as_nanos() as f64 / 1000.);
        }
        println!("clip {:.0} fit {:.0} whole {:.0} casters {:.0} ns", best[0], best[1], best[2], best[3]);
    }
}
