//! Slots touched all around, and in part.

use touchup::features::fit::{Ends, Fit, FitParams, Freedom, Stadium, SurfaceModel, fit};

use super::*;

const WIDTH: f64 = 6.0 * MM;
const LENGTH: f64 = 20.0 * MM;
const SIGMA: f64 = 0.03 * MM;

#[derive(Clone, Copy, PartialEq)]
enum Place {
    Wall(f64),
    End(f64),
}

/// Centres of a ball of 1 mm that touches a slot about z, along x, at its middle; each a group of
/// its own.
fn touches(rng: &mut Pcg64, ends: Ends, places: &[(Place, u32)]) -> Vec<Observation> {
    let ball = 1.0 * MM;
    let (half_width, half_length) = (WIDTH / 2.0 - ball, LENGTH / 2.0 - ball);
    let mut touched = Vec::new();
    for (place, count) in places {
        for _ in 0..*count {
            let z = between(rng, -2.0, 2.0) * MM;
            let (x, y) = match (place, ends) {
                (Place::Wall(side), _) => (between(rng, -6.5, 6.5) * MM, side * half_width),
                (Place::End(side), Ends::Straight) => {
                    (side * half_length, between(rng, -1.0, 1.0) * half_width)
                }
                (Place::End(side), Ends::Round) => {
                    let angle = between(rng, -1.5, 1.5);
                    (
                        side * (LENGTH / 2.0 - WIDTH / 2.0 + half_width * angle.cos()),
                        half_width * angle.sin(),
                    )
                }
            };
            let point = Point3::new(x, y, z) + shaken(rng, SIGMA);
            touched.push(Observation {
                point,
                offset: ball,
                sigma: SIGMA,
                group: touched.len() as u32,
            });
        }
    }
    touched
}

fn guess(ends: Ends) -> Stadium {
    let along = Vector3::new(1.0, 0.03, 0.0);
    let axis = Vector3::new(0.02, -0.02, 1.0);
    Stadium::new(
        Point3::new(0.4, -0.3, 0.2) * MM,
        &axis,
        &along,
        [6.5 * MM, 19.0 * MM],
        ends,
        true,
    )
}

#[test]
fn width_length_and_centre_are_right_in_the_mean_and_say_how_well() {
    let places = [
        (Place::Wall(1.0), 30),
        (Place::Wall(-1.0), 30),
        (Place::End(1.0), 20),
        (Place::End(-1.0), 20),
    ];
    for ends in [Ends::Round, Ends::Straight] {
        let mut z = [const { Vec::new() }; 5];
        for seed in 0..300 {
            let touched = touches(&mut generator(seed), ends, &places);
            let fit = fit(&guess(ends), &touched, &FitParams::default()).unwrap();
            let slot = &fit.surface;
            z[0].push((slot.width - WIDTH) / fit.std(Freedom::Size).unwrap());
            z[1].push((slot.length - LENGTH) / fit.std(Freedom::Second).unwrap());
            let at_0 = slot.center() - slot.axis() * (slot.center().z / slot.axis().z);
            z[2].push(at_0.x / fit.std(Freedom::X).unwrap());
            z[3].push(at_0.y / fit.std(Freedom::Y).unwrap());
            z[4].push(slot.direction().y / fit.std(Freedom::Turn).unwrap());
        }
        for (name, z) in ["width", "length", "x", "y", "turn"].iter().zip(&z) {
            let (mean, error) = mean_and_error(z);
            println!(
                "{ends:?} {name}: mean {mean:.3} ± {error:.3}, rms {:.3}",
                rms(z)
            );
            assert!((0.8..1.25).contains(&rms(z)), "{ends:?} {name}: {}", rms(z));
            assert!(
                mean.abs() < 3.5 * error,
                "{ends:?} {name}: {mean} ± {error}"
            );
        }
    }
}

#[test]
fn what_was_not_touched_is_undetermined() {
    use Place::{End, Wall};
    let walls = [(Wall(1.0), 30), (Wall(-1.0), 30)];
    let open = |places: &[(Place, u32)], ends| {
        let fit = fit(
            &guess(ends),
            &touches(&mut generator(3), ends, places),
            &FitParams::default(),
        )
        .unwrap();
        let is_open = |f: &Freedom| Stadium::FREE[*f as usize] && fit.std(*f).is_none();
        (
            Freedom::ALL.into_iter().filter(is_open).collect::<Vec<_>>(),
            fit,
        )
    };
    // distance of the end in a direction along x of F from the origin of F
    let end_std =
        |fit: &Fit<Stadium>, sign: f64| fit.std_by(&[(Freedom::X, sign), (Freedom::Second, 0.5)]);
    for ends in [Ends::Round, Ends::Straight] {
        // walls do not show whether they lean along themselves; an end does
        let (undetermined, of_walls) = open(&walls, ends);
        assert_eq!(
            undetermined,
            [Freedom::X, Freedom::TiltX, Freedom::Second],
            "{ends:?}"
        );
        assert_eq!(end_std(&of_walls, 1.0), None);
        assert!(
            (of_walls.surface.width - WIDTH).abs() < 4.0 * of_walls.std(Freedom::Size).unwrap()
        );

        let (undetermined, one_end) = open(&[walls[0], walls[1], (End(1.0), 20)], ends);
        assert_eq!(undetermined, [Freedom::X, Freedom::Second], "{ends:?}");
        let x = one_end.surface.center().x + one_end.surface.length / 2.0;
        let std = end_std(&one_end, 1.0).unwrap();
        assert!(
            (x - LENGTH / 2.0).abs() < 4.0 * std.max(SIGMA / 4.0),
            "{ends:?}: {x}"
        );
        assert_eq!(end_std(&one_end, -1.0), None);

        let (undetermined, _) = open(&walls[..1], ends);
        assert_eq!(
            undetermined,
            [
                Freedom::X,
                Freedom::Y,
                Freedom::TiltX,
                Freedom::Size,
                Freedom::Second
            ],
            "{ends:?}"
        );
    }
}

#[test]
fn an_oblong_boss_is_a_slot_turned_inside_out() {
    let ball = 1.0 * MM;
    let boss = Stadium::new(
        Point3::origin(),
        &Vector3::z(),
        &Vector3::x(),
        [WIDTH, LENGTH],
        Ends::Straight,
        false,
    );
    // beside a wall, beside an end, and off a corner at 3-4-5
    let cases = [
        ([0.0, 4.0], 1.0),
        ([-11.0, 2.0], 1.0),
        ([10.6, -3.8], 1.0),
        ([9.0, 0.0], -1.0),
    ];
    for ([x, y], distance) in cases {
        let found = boss.distance(&Point3::new(x * MM, y * MM, 0.0));
        assert!((found - distance * ball).abs() < 1e-15, "{x} {y}: {found}");
    }
}
