//! Form of points as they are: the zone about the reference of least squares, and the narrowest
//! zone of all.
//!
//! ISO 1101 asks for the narrowest zone that holds the feature (minimum zone); ISO 12181, 12780,
//! 12781 and 12180 also name the reference of least squares, about which the deviation is from the
//! lowest to the highest point. Both come from iterated linear equations about the last reference.
//! Points count as exact: noise widens either zone, see [`super::round_form()`] for noisy points.

use nalgebra::{Point2, Point3, SVector, SymmetricEigen, Vector2, Vector3};

use super::chebyshev::chebyshev;
use crate::numeric::{NormalEquations, centroid_and_spread, mean, scatter, tangent_basis};

/// Widths of two zones of the same points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Zone {
    /// from the lowest to the highest point about the reference of least squares, m
    pub least_squares: f64,
    /// of the narrowest zone, m
    pub minimum_zone: f64,
}

/// Maximum number of steps to a reference; each squares the error.
const MOST_STEPS: usize = 40;
/// Maximum number of halvings of a step that widens the zone.
const MOST_HALVINGS: usize = 30;
/// Least relative gain of a step that goes on to a narrower zone: some thousand roundings of a
/// coordinate.
const SETTLED: f64 = 1e-10;
/// Number of directions of the first tangents to the cylinder around an axis.
const FIRST_DIRECTIONS: usize = 8;

/// Deviations from a reference, m, with their derivatives by its freedoms; the last entry is
/// unused.
type Linear<const N: usize> = (Vec<SVector<f64, N>>, Vec<f64>);

/// Width of a zone, m.
fn width(values: &[f64]) -> f64 {
    let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(low, high), x| {
        (low.min(*x), high.max(*x))
    });
    (high - low).max(0.0)
}

/// The x of least Σ (value − row·x)², without the last entry of the rows.
fn least_squares<const N: usize>(
    rows: &[SVector<f64, N>],
    values: &[f64],
) -> Option<SVector<f64, N>> {
    let scale = rows
        .iter()
        .fold(SVector::<f64, N>::zeros(), |sum, row| {
            sum + row.component_mul(row)
        })
        .map(f64::sqrt);
    let scaled = |row: &SVector<f64, N>| {
        SVector::<f64, N>::from_fn(|j, _| {
            if j + 1 < N && scale[j] > 0.0 {
                row[j] / scale[j]
            } else {
                0.0
            }
        })
    };
    let mut equations = NormalEquations::<N>::of(
        rows.iter()
            .zip(values)
            .map(|(row, value)| (scaled(row), *value)),
    );
    equations.information[(N - 1, N - 1)] = 1.0;
    let x = equations.solution()?;
    Some(SVector::from_fn(|j, _| {
        if j + 1 < N {
            x[j] / scale[j].max(f64::MIN_POSITIVE)
        } else {
            0.0
        }
    }))
}

/// Both zones of values about a linear reference: deviations from a reference near to both.
///
/// - `rows`: of the reference, one of them constant; the last entry is unused.
pub(super) fn linear_zone<const N: usize>(
    rows: &[SVector<f64, N>],
    values: &[f64],
) -> Option<Zone> {
    let reference = least_squares(rows, values)?;
    let about: Vec<f64> = rows
        .iter()
        .zip(values)
        .map(|(row, value)| value - row.dot(&reference))
        .collect();
    let (_, half) = chebyshev(rows, &about)?;
    Some(Zone {
        least_squares: width(&about),
        minimum_zone: 2.0 * half,
    })
}

/// Both zones about references from iterated steps.
fn zone<S: Clone, const N: usize>(
    start: S,
    linear: impl Fn(&S) -> Linear<N>,
    moved: impl Fn(&S, &SVector<f64, N>) -> S,
) -> Option<Zone> {
    let square = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
    let solve_squares = |rows: &[SVector<f64, N>], values: &[f64]| least_squares(rows, values);
    let mean_reference = descended(start, &linear, &moved, solve_squares, square)?;
    let solve_largest = |rows: &[SVector<f64, N>], values: &[f64]| Some(chebyshev(rows, values)?.0);
    let narrowest = descended(
        mean_reference.clone(),
        &linear,
        &moved,
        solve_largest,
        width,
    )?;
    Some(Zone {
        least_squares: width(&linear(&mean_reference).1),
        minimum_zone: width(&linear(&narrowest).1),
    })
}

/// The reference of least cost near another.
fn descended<S: Clone, const N: usize>(
    mut at: S,
    linear: &impl Fn(&S) -> Linear<N>,
    moved: &impl Fn(&S, &SVector<f64, N>) -> S,
    solve: impl Fn(&[SVector<f64, N>], &[f64]) -> Option<SVector<f64, N>>,
    cost: impl Fn(&[f64]) -> f64,
) -> Option<S> {
    let (mut rows, mut values) = linear(&at);
    for _ in 0..MOST_STEPS {
        let (before, step) = (cost(&values), -solve(&rows, &values)?);
        let shorter =
            (0..MOST_HALVINGS).map(|halved| moved(&at, &(step * 0.5f64.powi(halved as i32))));
        let better = shorter
            .map(|next| (linear(&next), next))
            .find(|((_, values), _)| cost(values) < before);
        let Some(((next_rows, next_values), next)) = better else {
            break;
        };
        (rows, values, at) = (next_rows, next_values, next);
        if cost(&values) >= before * (1.0 - SETTLED) {
            break;
        }
    }
    values.iter().all(|x| x.is_finite()).then_some(at)
}

/// Principal axes of some points about their middle, the shortest first.
fn principal(points: &[Point3<f64>]) -> Option<(Point3<f64>, [Vector3<f64>; 3])> {
    let middle = Point3::from(mean(points.iter().map(|p| p.coords)));
    let scatter = scatter(points.iter().map(|p| p.coords));
    if !scatter.iter().all(|x| x.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(scatter);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    Some((
        middle,
        order.map(|i| eigen.eigenvectors.column(i).into_owned()),
    ))
}

/// Flatness of points, m (ISO 12781): distance of the two parallel planes that enclose them. `None`
/// for fewer than 4 points.
pub fn flatness(points: &[Point3<f64>]) -> Option<Zone> {
    let (middle, [normal, ..]) = principal(points).filter(|_| points.len() > 3)?;
    let linear = |(from, normal): &(Point3<f64>, Vector3<f64>)| {
        let [u, v] = tangent_basis(normal);
        let of_point = |p: &Point3<f64>| {
            let q = p - from;
            (
                SVector::from([-1.0, u.dot(&q), v.dot(&q), 0.0]),
                normal.dot(&q),
            )
        };
        points.iter().map(of_point).unzip()
    };
    let moved = |(from, normal): &(Point3<f64>, Vector3<f64>), step: &SVector<f64, 4>| {
        let [u, v] = tangent_basis(normal);
        (
            from + normal * step[0],
            (normal + u * step[1] + v * step[2]).normalize(),
        )
    };
    zone((middle, normal), linear, moved)
}

/// Straightness of points of a profile in a plane, m (ISO 12780): distance of the two parallel
/// lines that enclose them. `None` for fewer than 3 points.
pub fn straightness(points: &[Point2<f64>]) -> Option<Zone> {
    let spatial: Vec<Point3<f64>> = points.iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect();
    let (middle, [_, _, along]) = principal(&spatial).filter(|_| points.len() > 2)?;
    let linear = |(from, turn): &(Point2<f64>, f64)| {
        let (along, up) = (
            Vector2::new(turn.cos(), turn.sin()),
            Vector2::new(-turn.sin(), turn.cos()),
        );
        let of_point = |p: &Point2<f64>| {
            let q = p - from;
            (SVector::from([-1.0, -along.dot(&q), 0.0]), up.dot(&q))
        };
        points.iter().map(of_point).unzip()
    };
    let moved = |(from, turn): &(Point2<f64>, f64), step: &SVector<f64, 3>| {
        (
            from + Vector2::new(-turn.sin(), turn.cos()) * step[0],
            turn + step[1],
        )
    };
    zone((middle.xy(), along.y.atan2(along.x)), linear, moved)
}

/// Roundness of points of a section, m (ISO 12181): difference of the radii of the two concentric
/// circles that enclose them. `None` for fewer than 4 points, or without a circle.
pub fn roundness(points: &[Point2<f64>]) -> Option<Zone> {
    let middle = mean(points.iter().map(|p| Vector3::new(p.x, p.y, 0.0))).xy();
    // x² + y² = 2 a x + 2 b y + c, about the middle [Kåsa 1976]
    let rows: Vec<SVector<f64, 4>> = points
        .iter()
        .map(|p| SVector::from([2.0 * (p.x - middle.x), 2.0 * (p.y - middle.y), 1.0, 0.0]))
        .collect();
    let squares: Vec<f64> = points
        .iter()
        .map(|p| (p.coords - middle).norm_squared())
        .collect();
    let circle = least_squares(&rows, &squares).filter(|_| points.len() > 3)?;
    let radius = (circle[2] + circle[0] * circle[0] + circle[1] * circle[1])
        .max(0.0)
        .sqrt();
    let linear = |(centre, radius): &(Vector2<f64>, f64)| {
        let of_point = |p: &Point2<f64>| {
            let (q, rho) = (p.coords - centre, (p.coords - centre).norm());
            let away = q / rho.max(f64::MIN_POSITIVE);
            (SVector::from([-away.x, -away.y, -1.0, 0.0]), rho - radius)
        };
        points.iter().map(of_point).unzip()
    };
    let moved = |(centre, radius): &(Vector2<f64>, f64), step: &SVector<f64, 4>| {
        (centre + Vector2::new(step[0], step[1]), radius + step[2])
    };
    zone(
        (middle + Vector2::new(circle[0], circle[1]), radius),
        linear,
        moved,
    )
}

/// Cylindricity of points, m (ISO 12180): difference of the radii of the two coaxial cylinders that
/// enclose them. `None` for fewer than 6 points, or without a cylinder.
///
/// - `on_axis`, `axis`: of a cylinder near them; a unit vector.
pub fn cylindricity(
    points: &[Point3<f64>],
    on_axis: &Point3<f64>,
    axis: &Vector3<f64>,
) -> Option<Zone> {
    let (middle, _) = centroid_and_spread(points.iter());
    let foot = on_axis + axis * (middle - on_axis).dot(axis);
    let across = |p: &Point3<f64>| (p - foot) - axis * (p - foot).dot(axis);
    let radius = points.iter().map(|p| across(p).norm()).sum::<f64>() / points.len() as f64;
    if points.len() < 6 || radius.is_nan() || radius <= 0.0 {
        return None;
    }
    let linear = |(from, axis, radius): &(Point3<f64>, Vector3<f64>, f64)| {
        let [u, v] = tangent_basis(axis);
        let of_point = |p: &Point3<f64>| {
            let q = p - from;
            let (x, y, z) = (u.dot(&q), v.dot(&q), axis.dot(&q));
            let rho = x.hypot(y);
            let (cos, sin) = (
                x / rho.max(f64::MIN_POSITIVE),
                y / rho.max(f64::MIN_POSITIVE),
            );
            (
                SVector::from([-cos, -sin, -z * cos, -z * sin, -1.0, 0.0]),
                rho - radius,
            )
        };
        points.iter().map(of_point).unzip()
    };
    let moved = |(from, axis, radius): &(Point3<f64>, Vector3<f64>, f64),
                 step: &SVector<f64, 6>| {
        let [u, v] = tangent_basis(axis);
        let turned = (axis + u * step[2] + v * step[3]).normalize();
        (from + u * step[0] + v * step[1], turned, radius + step[4])
    };
    zone((foot, *axis, radius), linear, moved)
}

/// Straightness of an axis, m (ISO 1101): diameter of the cylinder that encloses the middles of its
/// sections. `None` for fewer than 3.
pub(crate) fn axis_straightness(middles: &[Point3<f64>]) -> Option<Zone> {
    let (from, [_, _, along]) = principal(middles).filter(|_| middles.len() > 2)?;
    let [u, v] = tangent_basis(&along);
    let local: Vec<(Vector2<f64>, f64)> = middles
        .iter()
        .map(|p| {
            (
                Vector2::new(u.dot(&(p - from)), v.dot(&(p - from))),
                along.dot(&(p - from)),
            )
        })
        .collect();
    let least_squares = 2.0 * local.iter().map(|(q, _)| q.norm()).fold(0.0, f64::max);
    // each point inside of tangents to the cylinder: first some all around, then those facing the
    // point
    let row = |(q, z): &(Vector2<f64>, f64), w: &Vector2<f64>| {
        (SVector::from([w.x, w.y, w.x * z, w.y * z, 0.0]), w.dot(q))
    };
    let around = (0..FIRST_DIRECTIONS).map(|i| {
        let (sin, cos) = (std::f64::consts::PI * i as f64 / FIRST_DIRECTIONS as f64).sin_cos();
        Vector2::new(cos, sin)
    });
    let (mut rows, mut values): Linear<5> = around
        .flat_map(|w| local.iter().map(move |point| row(point, &w)))
        .unzip();
    let mut narrowest = least_squares;
    for _ in 0..MOST_STEPS {
        let (x, half) = chebyshev(&rows, &values)?;
        let off = |(q, z): &(Vector2<f64>, f64)| q - Vector2::new(x[0] + x[2] * z, x[1] + x[3] * z);
        let most = local
            .iter()
            .map(|point| off(point).norm())
            .fold(0.0, f64::max);
        narrowest = narrowest.min(2.0 * most);
        if most <= half * (1.0 + SETTLED) {
            break;
        }
        for point in &local {
            if let Some(w) = off(point).try_normalize(0.0) {
                let (row, value) = row(point, &w);
                rows.push(row);
                values.push(value);
            }
        }
    }
    Some(Zone {
        least_squares,
        minimum_zone: narrowest,
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::Rotation3;

    use super::*;

    /// Points of a section at even angles, turned and shifted.
    fn section(count: u32, radius: impl Fn(f64) -> f64) -> Vec<Point2<f64>> {
        let at = |i: u32| TAU * f64::from(i) / f64::from(count);
        (0..count)
            .map(|i| {
                Point2::new(
                    0.3 + radius(at(i)) * at(i).cos(),
                    -0.2 + radius(at(i)) * at(i).sin(),
                )
            })
            .collect()
    }

    fn is_near(found: f64, expected: f64, by: f64) -> bool {
        (found - expected).abs() <= by
    }

    /// Both circles about the centre of an ellipse touch it twice each, by turns: no narrower ring
    /// holds it. By symmetry the circle of least squares has the same centre.
    #[test]
    fn an_ellipse_is_out_of_round_by_the_difference_of_its_semi_axes() {
        let (a, b) = (5e-3, 4.95e-3);
        let points: Vec<_> = (0..360)
            .map(|i| f64::from(i).to_radians())
            .map(|t| Point2::new(0.1 + a * t.cos(), b * t.sin()))
            .collect();
        let zone = roundness(&points).unwrap();
        assert!(
            is_near(zone.minimum_zone, a - b, 1e-12) && is_near(zone.least_squares, a - b, 1e-12),
            "{zone:?}"
        );
    }

    #[test]
    fn three_lobes_are_as_deep_as_twice_their_amplitude_wherever_the_section_lies() {
        let zone = roundness(&section(360, |t| 4e-3 + 25e-6 * (3.0 * t).cos())).unwrap();
        assert!(
            is_near(zone.minimum_zone, 50e-6, 1e-12) && is_near(zone.least_squares, 50e-6, 1e-12),
            "{zone:?}"
        );
        // one flat of depth h beside a round rest: the narrowest zone is narrower than the one
        // about least squares
        let flat = |t: f64| {
            4e-3 - if t < 1.0 {
                20e-6 * (TAU * t / 2.0).sin()
            } else {
                0.0
            }
        };
        let zone = roundness(&section(720, flat)).unwrap();
        assert!(
            zone.minimum_zone < zone.least_squares && zone.minimum_zone > 10e-6,
            "{zone:?}"
        );
        assert_eq!(roundness(&section(3, |_| 1.0)), None);
        assert_eq!(roundness(&[Point2::new(f64::NAN, 0.0); 9]), None);
    }

    /// For z = c x y over a square of half side h the corners are ± c h², and no tilted pair of
    /// planes is closer: two opposite corners are up and the other two down.
    #[test]
    fn a_saddle_is_off_flat_by_its_corners_in_any_position() {
        let (c, h, turn) = (0.5, 0.01, Rotation3::from_euler_angles(0.4, 1.1, -2.0));
        let at = |i: i32| h * f64::from(i) / 10.0;
        let grid = (-10..=10).flat_map(|i| (-10..=10).map(move |j| (at(i), at(j))));
        let points: Vec<_> = grid
            .map(|(x, y)| turn * Point3::new(x, y, c * x * y) + Vector3::new(1.0, 2.0, 3.0))
            .collect();
        let zone = flatness(&points).unwrap();
        assert!(
            is_near(zone.minimum_zone, 2.0 * c * h * h, 1e-10)
                && is_near(zone.least_squares, 2.0 * c * h * h, 1e-10)
        );
        let flat: Vec<_> = (0..9)
            .map(|i| turn * Point3::new(at(i % 3), at(i / 3), 0.0))
            .collect();
        assert!(flatness(&flat).unwrap().minimum_zone < 1e-15);
        assert_eq!(flatness(&points[..3]), None);
    }

    /// The parabola y = c x² over [−h, h]: parallel lines through its ends and its vertex, c h²
    /// apart.
    #[test]
    fn a_bowed_line_is_off_straight_by_its_sagitta() {
        let (c, h) = (2.0, 5e-3);
        let points: Vec<_> = (-50..=50)
            .map(|i| h * f64::from(i) / 50.0)
            .map(|x| Point2::new(x, c * x * x))
            .collect();
        let turned: Vec<_> = points
            .iter()
            .map(|p| Point2::new(0.6 * p.x - 0.8 * p.y, 0.8 * p.x + 0.6 * p.y))
            .collect();
        for points in [points, turned] {
            let zone = straightness(&points).unwrap();
            assert!(
                is_near(zone.minimum_zone, c * h * h, 1e-12)
                    && is_near(zone.least_squares, c * h * h, 1e-12),
                "{zone:?}"
            );
        }
    }

    /// A cone of slope k over a height: its radii differ by k times the height, and no tilted pair
    /// of cylinders is closer together.
    #[test]
    fn a_cone_is_off_a_cylinder_by_the_difference_of_its_end_radii() {
        let (slope, height, turn) = (0.002, 8e-3, Rotation3::from_euler_angles(1.0, 0.2, 0.3));
        let of_ring = |ring: u32| {
            let z = height * (f64::from(ring) / 10.0 - 0.5);
            section(90, move |_| 4e-3 + slope * z)
                .into_iter()
                .map(move |p| Point3::new(p.x, p.y, z))
        };
        let points: Vec<_> = (0..=10).flat_map(of_ring).map(|p| turn * p).collect();
        let lean = Rotation3::from_euler_angles(0.01, 0.0, 0.0);
        let zone = cylindricity(
            &points,
            &(turn * Point3::new(0.3001, -0.2, 0.0)),
            &(turn * lean * Vector3::z()),
        )
        .unwrap();
        let expected = slope * height;
        assert!(
            is_near(zone.minimum_zone, expected, 1e-10)
                && is_near(zone.least_squares, expected, 1e-10),
            "{zone:?}"
        );
    }

    /// Middles on a climbing circle of radius r: the cylinder about the mean axis has the diameter
    /// 2 r. On a parabola: its sagitta.
    #[test]
    fn an_axis_is_as_straight_as_the_cylinder_that_holds_it_is_thin() {
        let bow: Vec<_> = (-4..=4)
            .map(|i| f64::from(i) * 1e-3)
            .map(|z| Point3::new(2.0 * z * z, 0.0, z))
            .collect();
        let zone = axis_straightness(&bow).unwrap();
        assert!(
            is_near(zone.minimum_zone, 2.0 * 16e-6, 1e-9 * 16e-6),
            "{zone:?}"
        );
        let helix: Vec<_> = (0..=360)
            .map(|i| f64::from(i) * TAU / 90.0)
            .map(|t| Point3::new(1e-5 * t.cos(), 1e-5 * t.sin(), 1e-3 * t))
            .collect();
        let zone = axis_straightness(&helix).unwrap();
        assert!(
            zone.minimum_zone <= zone.least_squares && is_near(zone.minimum_zone, 2e-5, 2e-7),
            "{zone:?}"
        );
        assert_eq!(axis_straightness(&bow[..2]), None);
        let flat =
            [-1.0, -0.5, 0.0, 0.5, 1.0f64].map(|z| Point3::new(4e-5 * z * z, 1e-6 * z * z, z));
        let zone = axis_straightness(&flat).unwrap();
        assert!(
            is_near(zone.minimum_zone, 4e-5f64.hypot(1e-6), 1e-12),
            "in units of its own: {zone:?}"
        );
    }
}
