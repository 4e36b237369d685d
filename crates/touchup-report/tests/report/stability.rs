//! The stability part of the report: the promises of the default integrator hold, and the known
//! failures of the others show.

use touchup_report::Effort;
use touchup_report::stability::{Integrator, RunEnding, bounded_steps, stability};

use super::full;

#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn the_default_is_stable_everywhere_and_explicit_euler_is_not() {
    let measured = stability(Effort { is_quick: true }, &mut |_| {});
    for flow in &measured.sub_flows {
        println!(
            "{}: {} cases, {:e} at {}",
            flow.name, flow.cases, flow.largest_error, flow.worst
        );
        assert!(
            flow.cases > 100 && flow.largest_error > 0.0,
            "{}: it was compared",
            flow.name
        );
        assert!(
            flow.largest_error <= 1e-10,
            "{}: {:e} at {}",
            flow.name,
            flow.largest_error,
            flow.worst
        );
    }
    for shares in &measured.faces {
        let stable = shares.endings.stable_share();
        println!(
            "{:?} {stable} {:?} unit {}",
            shares.integrator, shares.endings, shares.unit_share
        );
    }
    for shares in &measured.meshes {
        println!(
            "{:?} {} {:?}",
            shares.shape,
            shares.endings.stable_share(),
            shares.endings
        );
    }
    let of = |integrator| {
        measured
            .faces
            .iter()
            .find(|shares| shares.integrator == integrator)
            .unwrap()
            .endings
    };
    let lie = of(Integrator::Lie);
    assert!(
        lie.count(RunEnding::Stable) == lie.runs() && lie.runs() > 0,
        "{lie:?}"
    );
    // one step of explicit Euler goes over the rest point from dt > 1/(alpha slope) on: about half
    // of the runs are stiffer
    let euler = of(Integrator::ExplicitEuler);
    assert!((0.2..0.8).contains(&euler.stable_share()), "{euler:?}");
    assert!(of(Integrator::DormandPrince).count(RunEnding::GaveUp) > 0);
    println!(
        "default on meshes: stable from {:?}",
        measured.default_stable_from_quality()
    );
    // scanned triangles thinner than the guard's limit of 0.15 follow a touch, too
    assert!(
        measured
            .default_stable_from_quality()
            .is_some_and(|quality| quality < 0.1)
    );
    for text in measured.chapter().text {
        println!("{text}");
    }
}

/// 240 samples, 10,000 in the slow proofs; against collocation of order 13 in numbers of 32 digits.
#[test]
fn the_step_with_an_error_bound_keeps_it_however_stiff_the_sample_is() {
    let cases = full::either(60, 2_500);
    for group in bounded_steps(11, cases) {
        println!("{group:?}");
        assert_eq!(group.refused, 0, "{group:?}");
        assert!(group.position <= 1.0 && group.normal <= 1.0, "{group:?}");
        // nearly all have a path that numbers can follow
        let left_out = group.without_reference + group.undetermined + group.ill_conditioned;
        assert!(
            group.cases + group.without_reference == cases && 20 * left_out <= cases,
            "{group:?}"
        );
    }
}
