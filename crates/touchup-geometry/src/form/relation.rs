//! Orientation, location and distance of features, by their fitted axes and planes (ISO 1101).
//!
//! The first element of each function is the toleranced one, whose extent counts; the second is the
//! datum. Values are computed for changes of all elements, one standard deviation at a time in each
//! independent direction, ± √n of it for n directions: mean and spread over these places are exact
//! for linear and square functions. The common error of all touches is changed once, for all
//! elements together.
//!
//! Widths and diameters cannot be negative, so noise makes them larger: w² by its variance, which
//! is subtracted. A perfect one thus has 0 within its uncertainty.

use nalgebra::{Point3, Vector3, Vector6};

use super::datum::datum_frame;
use super::element::{Element, Shape};
use super::profile::Estimate;

/// Spread of a value over changes of the elements: the value of the elements themselves, mean
/// square of all, and mean square of their differences from it. `None` if one is not finite.
fn spread(elements: &[&Element], value: impl Fn(&[Element]) -> Option<f64>) -> Option<[f64; 3]> {
    let own: Vec<Element> = elements.iter().map(|&element| element.clone()).collect();
    let here = value(&own).filter(|x| x.is_finite())?;
    let changes: Vec<(usize, Vector6<f64>)> = own
        .iter()
        .enumerate()
        .flat_map(|(i, e)| e.deviations().into_iter().map(move |by| (i, by)))
        .collect();
    let calibration = own.iter().map(|e| e.calibration).fold(0.0, f64::max);
    let count = changes.len() as f64 + 1.0;
    let (mut squares, mut off) = (0.0, 0.0);
    for sign in [count.sqrt(), -count.sqrt()] {
        let changed = changes.iter().map(|(i, by)| {
            let mut all = own.clone();
            all[*i] = own[*i].moved(&(by * sign));
            all
        });
        let lifted = own.iter().map(|e| e.lifted(calibration * sign)).collect();
        for all in changed.chain([lifted]) {
            let there = value(&all).filter(|x| x.is_finite())?;
            squares += there * there / (2.0 * count);
            off += (there - here) * (there - here) / (2.0 * count);
        }
    }
    Some([here, squares, off])
}

/// A number of any sign.
fn number(elements: &[&Element], value: impl Fn(&[Element]) -> Option<f64>) -> Option<Estimate> {
    spread(elements, value).map(|[value, _, off]| Estimate {
        value,
        std: off.sqrt(),
    })
}

/// A number of 0 or more, without the contribution of noise.
fn size(elements: &[&Element], value: impl Fn(&[Element]) -> Option<f64>) -> Option<Estimate> {
    spread(elements, value).map(|[here, squares, off]| {
        let added = (squares - here * here).max(0.0);
        Estimate {
            value: (here * here - added).max(0.0).sqrt(),
            std: off.sqrt(),
        }
    })
}

/// Angle between two axes, two normals, or an axis and a normal, 0 to π/2.
pub fn angle(a: &Element, b: &Element) -> Option<Estimate> {
    let between = |e: &[Element]| {
        let (cos, sin) = (
            e[0].direction.dot(&e[1].direction).abs(),
            e[0].direction.cross(&e[1].direction).norm(),
        );
        Some(sin.atan2(cos))
    };
    size(&[a, b], between)
}

/// Whether nominally equal directions (axis and axis, normal and normal, axis and normal of a
/// square plane) belong to parallelism.
fn is_parallelism(a: Shape, b: Shape, is_aligned: bool) -> bool {
    (a == b) == is_aligned
}

/// A deviation of orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientationDeviation {
    /// whether the features are nominally parallel, and not perpendicular
    pub is_parallel: bool,
    /// width of the zone between parallel planes, or diameter of the cylinder, that encloses the
    /// toleranced feature over its extent, m
    pub zone: Estimate,
    /// deviation of the angle from 0° or 90°, rad
    pub off: Estimate,
}

/// Parallelism or perpendicularity to a datum, whichever is nearer.
///
/// Nominally equal directions deviate in two components, and the zone is as wide as the extent
/// along the worse (for a toleranced axis: a cylinder). Nominally square ones deviate in one, and
/// may turn about the other.
pub fn orientation(toleranced: &Element, datum: &Element) -> Option<OrientationDeviation> {
    let is_aligned =
        toleranced.direction.dot(&datum.direction).abs() > std::f64::consts::FRAC_1_SQRT_2;
    let off = |e: &[Element]| {
        let (cos, sin) = (
            e[0].direction.dot(&e[1].direction).abs(),
            e[0].direction.cross(&e[1].direction).norm(),
        );
        Some(if is_aligned {
            sin.atan2(cos)
        } else {
            cos.atan2(sin)
        })
    };
    let zone = |e: &[Element]| {
        let (t, d) = (&e[0], &e[1].direction);
        // a plane over its extent along the nominal normal; an axis by its ends
        Some(match (t.shape, is_aligned) {
            (Shape::Plane, true) => t.span(d),
            (Shape::Axis, true) => t.length() * t.direction.cross(d).norm(),
            (Shape::Axis, false) => t.length() * t.direction.dot(d).abs(),
            (Shape::Plane, false) => {
                let along = (d - t.direction * t.direction.dot(d)).try_normalize(0.0)?;
                t.span(&along) * t.direction.dot(d).abs()
            }
        })
    };
    Some(OrientationDeviation {
        is_parallel: is_parallelism(toleranced.shape, datum.shape, is_aligned),
        zone: size(&[toleranced, datum], zone)?,
        off: size(&[toleranced, datum], off)?,
    })
}

/// Offset of a place from an axis, m.
fn from_axis(p: &Point3<f64>, axis: &Element) -> Vector3<f64> {
    let v = p - axis.point;
    v - axis.direction * v.dot(&axis.direction)
}

/// Coaxiality, m: diameter of the cylinder about the axis of the datum that encloses the toleranced
/// axis over its extent. `None` for planes.
pub fn coaxiality(toleranced: &Element, datum: &Element) -> Option<Estimate> {
    let is_round = [toleranced, datum].iter().all(|e| e.shape == Shape::Axis);
    let diameter = |e: &[Element]| {
        e[0].extent
            .iter()
            .map(|p| 2.0 * from_axis(p, &e[1]).norm())
            .reduce(f64::max)
    };
    size(&[toleranced, datum], diameter).filter(|_| is_round)
}

/// Concentricity, m: diameter of the circle about the axis of the datum through the middle of the
/// toleranced axis. `None` for planes.
pub fn concentricity(toleranced: &Element, datum: &Element) -> Option<Estimate> {
    let is_round = [toleranced, datum].iter().all(|e| e.shape == Shape::Axis);
    size(&[toleranced, datum], |e| {
        Some(2.0 * from_axis(&e[0].point, &e[1]).norm())
    })
    .filter(|_| is_round)
}

/// Distance of the middle of the touched part from the datum, m: from a plane along its normal,
/// from an axis across it.
pub fn distance(a: &Element, datum: &Element) -> Option<Estimate> {
    let apart = |e: &[Element]| match (e[0].shape, e[1].shape) {
        (_, Shape::Plane) => Some((e[0].point - e[1].point).dot(&e[1].direction).abs()),
        (Shape::Plane, Shape::Axis) => Some((e[1].point - e[0].point).dot(&e[0].direction).abs()),
        (Shape::Axis, Shape::Axis) => Some(from_axis(&e[0].point, &e[1]).norm()),
    };
    number(&[a, datum], apart)
}

/// Position, m: diameter of the cylinder about the true axis that encloses the toleranced axis over
/// its extent, or twice the farthest place of a toleranced plane from the true one (ISO 5458).
///
/// - `system`: the datums A, B and C, see [`datum_frame`]; `true_place`, `true_direction`: in their
///   frame, m and a unit vector.
pub fn position(
    toleranced: &Element,
    system: [&Element; 3],
    true_place: &Point3<f64>,
    true_direction: &Vector3<f64>,
) -> Option<Estimate> {
    let [a, b, c] = system;
    let diameter = |e: &[Element]| {
        let frame = datum_frame([&e[1], &e[2], &e[3]])?;
        let off = |p: &Point3<f64>| {
            let v = frame.inverse_transform_point(p) - true_place;
            let along = v.dot(true_direction);
            if e[0].shape == Shape::Plane {
                along.abs()
            } else {
                (v - true_direction * along).norm()
            }
        };
        e[0].extent.iter().map(|p| 2.0 * off(p)).reduce(f64::max)
    };
    size(&[toleranced, a, b, c], diameter)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix6;
    use rand::SeedableRng;
    use rand::distr::Distribution;
    use rand_distr::StandardNormal;

    use super::*;

    const SHIFT: f64 = 3e-6;
    const TURN: f64 = 2e-4;

    /// Element with independent errors of SHIFT and TURN in all directions that matter.
    fn element(shape: Shape, point: [f64; 3], direction: [f64; 3], extent: &[[f64; 3]]) -> Element {
        let (point, direction) = (Point3::from(point), Vector3::from(direction).normalize());
        let along = direction * direction.transpose();
        let free = match shape {
            Shape::Axis => nalgebra::Matrix3::identity() - along,
            Shape::Plane => along,
        };
        let mut covariance = Matrix6::zeros();
        covariance
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(free * SHIFT * SHIFT));
        covariance
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&((nalgebra::Matrix3::identity() - along) * TURN * TURN));
        let extent = extent.iter().map(|p| Point3::from(*p)).collect();
        Element {
            shape,
            point,
            direction,
            covariance,
            calibration: 0.0,
            extent,
        }
    }

    fn exact(element: Element) -> Element {
        Element {
            covariance: Matrix6::zeros(),
            ..element
        }
    }

    /// A bore along z, 10 mm long, that leans by `lean` towards x.
    fn bore(lean: f64, x: f64) -> Element {
        let (sin, cos) = f64::sin_cos(lean);
        let end = |t: f64| [x + t * sin, 0.0, t * cos];
        element(
            Shape::Axis,
            [x, 0.0, 0.0],
            [sin, 0.0, cos],
            &[end(-5e-3), end(5e-3)],
        )
    }

    /// The face z = 0 of a block, 40 × 20 mm.
    fn face() -> Element {
        let corners = [
            [-0.02, -0.01, 0.0],
            [0.02, -0.01, 0.0],
            [0.02, 0.01, 0.0],
            [-0.02, 0.01, 0.0],
        ];
        element(Shape::Plane, [0.0; 3], [0.0, 0.0, 1.0], &corners)
    }

    fn is_near(estimate: Estimate, value: f64, by: f64) -> bool {
        (estimate.value - value).abs() <= by
    }

    #[test]
    fn exact_elements_have_the_relations_of_the_drawing() {
        let lean = 0.1f64.to_radians();
        let (bore_1, face_1) = (exact(bore(lean, 0.0)), exact(face()));
        let square = orientation(&bore_1, &face_1).unwrap();
        assert!(
            !square.is_parallel
                && is_near(square.zone, 10e-3 * lean.sin(), 1e-12)
                && is_near(square.off, lean, 1e-12)
        );
        let straight = exact(bore(0.0, 12e-3));
        let parallel = orientation(&bore_1, &straight).unwrap();
        assert!(
            parallel.is_parallel && is_near(parallel.zone, 10e-3 * lean.sin(), 1e-12),
            "{parallel:?}"
        );
        assert!(is_near(distance(&bore_1, &straight).unwrap(), 12e-3, 1e-15));
        assert!(is_near(angle(&bore_1, &straight).unwrap(), lean, 1e-12));
        // ends at ± 5 mm sin(lean) from the other axis
        let coaxial = coaxiality(&bore_1, &exact(bore(0.0, 0.0))).unwrap();
        assert!(is_near(coaxial, 10e-3 * lean.sin(), 1e-12), "{coaxial:?}");
        assert!(is_near(
            concentricity(&bore_1, &exact(bore(0.0, 1e-5))).unwrap(),
            2e-5,
            1e-12
        ));
        assert_eq!(coaxiality(&bore_1, &face_1), None);
        // a wall that leans by the same about y, 8 mm high
        let (sin, cos) = lean.sin_cos();
        let high = |t: f64, y: f64| [t * sin, y, t * cos];
        let corners = [
            high(0.0, -0.01),
            high(0.0, 0.01),
            high(8e-3, 0.01),
            high(8e-3, -0.01),
        ];
        let wall = exact(element(
            Shape::Plane,
            corners[0],
            [cos, 0.0, -sin],
            &corners,
        ));
        let square = orientation(&wall, &face_1).unwrap();
        assert!(
            !square.is_parallel
                && is_near(square.zone, 8e-3 * sin, 1e-9)
                && is_near(square.off, lean, 1e-12),
            "{square:?}"
        );
        // a face that leans about y over 40 mm
        let tilted = face_1.moved(&Vector6::new(0.0, 0.0, 5e-3, 1e-3, 0.0, 0.0));
        let parallel = orientation(&tilted, &face_1).unwrap();
        assert!(
            parallel.is_parallel && is_near(parallel.zone, 0.04 * 1e-3, 1e-9),
            "{parallel:?}"
        );
        assert!(is_near(distance(&tilted, &face_1).unwrap(), 5e-3, 1e-12));
    }

    #[test]
    fn a_bore_off_its_true_place_has_a_position_of_twice_that() {
        let plane = |point: [f64; 3], normal: [f64; 3]| {
            exact(element(Shape::Plane, point, normal, &[point]))
        };
        let [a, b, c] = [
            plane([0.0; 3], [0.0, 0.0, 1.0]),
            plane([0.0; 3], [1.0, 0.0, 0.0]),
            plane([0.0; 3], [0.0, 1.0, 0.0]),
        ];
        let bore = exact(bore(0.0, 20.03e-3));
        let found = position(
            &bore,
            [&a, &b, &c],
            &Point3::new(20e-3, 0.04e-3, 0.0),
            &Vector3::z(),
        )
        .unwrap();
        assert!(is_near(found, 0.1e-3, 1e-12), "{found:?}");
        assert_eq!(
            position(&bore, [&a, &a, &c], &Point3::origin(), &Vector3::z()),
            None
        );
    }

    /// With the same calibration error, two faces to the same side move alike; two opposite faces
    /// do not.
    #[test]
    fn a_calibration_goes_twice_into_a_thickness_and_not_into_a_step() {
        let with = |element: Element| Element {
            calibration: 2e-6,
            ..exact(element)
        };
        let top = with(face().moved(&Vector6::new(0.0, 0.0, 4e-3, 0.0, 0.0, 0.0)));
        let bottom = Element {
            direction: -Vector3::z(),
            ..with(face())
        };
        let step = distance(&top, &with(face())).unwrap();
        let thickness = distance(&top, &bottom).unwrap();
        assert!(
            step.std < 1e-15 && (thickness.std - 4e-6).abs() < 1e-12,
            "{step:?} {thickness:?}"
        );
    }

    type Relation = Box<dyn Fn(&[Element]) -> Option<Estimate>>;

    /// Name, elements and true value of a relation.
    type RelationCase = (&'static str, Vec<Element>, f64, Relation);

    fn orientation_cases() -> Vec<RelationCase> {
        let zone: fn(&[Element]) -> Option<Estimate> = |e| Some(orientation(&e[0], &e[1])?.zone);
        vec![
            (
                "bore ⟂ face, 0.1°",
                vec![bore(1.745e-3, 0.0), face()],
                10e-3 * 1.745e-3,
                Box::new(zone),
            ),
            (
                "bore ⟂ face",
                vec![bore(0.0, 0.0), face()],
                0.0,
                Box::new(zone),
            ),
            (
                "bore ∥ bore, 0.1°",
                vec![bore(1.745e-3, 0.0), bore(0.0, 0.03)],
                10e-3 * 1.745e-3,
                Box::new(zone),
            ),
        ]
    }

    fn location_cases() -> Vec<RelationCase> {
        let plane =
            |point: [f64; 3], normal: [f64; 3]| element(Shape::Plane, point, normal, &[point]);
        let system = [
            plane([0.0; 3], [0.0, 0.0, 1.0]),
            plane([0.0; 3], [1.0, 0.0, 0.0]),
            plane([0.0; 3], [0.0, 1.0, 0.0]),
        ];
        let place = |x: f64| -> Relation {
            Box::new(move |e| {
                position(
                    &e[0],
                    [&e[1], &e[2], &e[3]],
                    &Point3::new(x, 0.0, 0.0),
                    &Vector3::z(),
                )
            })
        };
        let with_system = |bore: Element| [vec![bore], system.to_vec()].concat();
        vec![
            (
                "coaxial, 30 µm off",
                vec![bore(0.0, 30e-6), bore(0.0, 0.0)],
                60e-6,
                Box::new(|e| coaxiality(&e[0], &e[1])),
            ),
            (
                "concentric, 30 µm off",
                vec![bore(0.0, 30e-6), bore(0.0, 0.0)],
                60e-6,
                Box::new(|e| concentricity(&e[0], &e[1])),
            ),
            (
                "distance",
                vec![bore(0.0, 0.03), bore(0.0, 0.0)],
                0.03,
                Box::new(|e| distance(&e[0], &e[1])),
            ),
            (
                "angle, 0.1°",
                vec![bore(1.745e-3, 0.0), face()],
                1.745e-3,
                Box::new(|e| angle(&e[0], &e[1])),
            ),
            (
                "position, 50 µm off",
                with_system(bore(0.0, 0.02005)),
                100e-6,
                place(0.02),
            ),
        ]
    }

    /// Elements with errors as large as they state: root mean square of error over uncertainty of
    /// each relation, for a perfect and for an imperfect one.
    #[test]
    fn relations_are_off_by_their_uncertainty() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1101);
        let cases = orientation_cases().into_iter().chain(location_cases());
        for (name, elements, truth, found) in cases {
            let (count, mut squares, mut mean) = (400, 0.0, 0.0);
            for _ in 0..count {
                let drawn: Vec<Element> = elements
                    .iter()
                    .map(|e| {
                        let by = e.deviations().into_iter().map(|d| {
                            let x: f64 = StandardNormal.sample(&mut rng);
                            d * x
                        });
                        let by = by.sum::<Vector6<f64>>();
                        e.moved(&by)
                    })
                    .collect();
                let Estimate { value, std } = found(&drawn).unwrap();
                squares += ((value - truth) / std).powi(2) / f64::from(count);
                mean += (value - truth) / f64::from(count);
            }
            let rms = squares.sqrt();
            println!(
                "{name}: mean error {:.2} µm or µrad; error/std {rms:.2}",
                mean * 1e6
            );
            let least = if truth > 0.0 { 0.8 } else { 0.3 };
            assert!((least..=1.25).contains(&rms), "{name}: {rms}");
        }
    }
}
