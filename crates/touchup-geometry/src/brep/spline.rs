//! Curves through points with tangents: cubic Hermite spans, once differentiable.

use nalgebra::{Point3, Vector3};

use super::placement::is_finite;

/// One node of a spline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveNode {
    /// m
    pub point: Point3<f64>,
    /// unit vector along the curve
    pub tangent: Vector3<f64>,
}

/// A spline as a cubic B-spline: (control points, knots). Inner knots count twice, outer ones four
/// times.
#[derive(Clone, Debug, PartialEq)]
pub struct SplineForm {
    /// 2 n for n nodes, m
    pub control_points: Vec<Point3<f64>>,
    /// one for each node: length of the chords up to it, m
    pub knots: Vec<f64>,
}

/// The B-spline that is the same curve as the spans between nodes.
pub fn spline_form(nodes: &[CurveNode]) -> SplineForm {
    let (mut control_points, mut knots) = (Vec::new(), vec![0.0]);
    control_points.extend(nodes.first().map(|node| node.point));
    for pair in nodes.windows(2) {
        let [_, out, into, _] = span(pair);
        control_points.extend([out, into]);
        let length = (pair[1].point - pair[0].point).norm();
        knots.push(knots[knots.len() - 1] + length);
    }
    control_points.extend(nodes.last().map(|node| node.point));
    SplineForm {
        control_points,
        knots,
    }
}

/// Bézier points of the span between two nodes.
fn span(pair: &[CurveNode]) -> [Point3<f64>; 4] {
    let (from, to) = (pair[0], pair[1]);
    let third = (to.point - from.point).norm() / 3.0;
    [
        from.point,
        from.point + from.tangent * third,
        to.point - to.tangent * third,
        to.point,
    ]
}

/// Point and derivative at a parameter: number of the span, and share of it.
pub(super) fn evaluate(nodes: &[CurveNode], t: f64) -> (Point3<f64>, Vector3<f64>) {
    let last = nodes.len().saturating_sub(2);
    let at = (t.max(0.0) as usize).min(last);
    let Some(pair) = nodes.get(at..at + 2) else {
        return (Point3::new(f64::NAN, f64::NAN, f64::NAN), Vector3::zeros());
    };
    let [a, b, c, d] = span(pair).map(|p| p.coords);
    let s = (t - at as f64).clamp(0.0, 1.0);
    let r = 1.0 - s;
    let point = a * (r * r * r) + (b * (r * s) + c * (s * s)) * (3.0 * r) + d * (s * s * s);
    let derivative = ((b - a) * (r * r) + (c - b) * (2.0 * r * s) + (d - c) * (s * s)) * 3.0;
    (point.into(), derivative)
}

/// Parameter of the place nearest to a point: best chord, then Newton's method.
pub(super) fn parameter(nodes: &[CurveNode], p: &Point3<f64>) -> f64 {
    /// The foot on a chord is right to a few percent of a span.
    const STEPS: usize = 8;
    let on_chord = |(at, pair): (usize, &[CurveNode])| {
        let chord = pair[1].point - pair[0].point;
        let share = (p - pair[0].point).dot(&chord) / chord.norm_squared();
        let share = share.clamp(0.0, 1.0);
        let off = (pair[0].point + chord * share - p).norm_squared();
        (off, at as f64 + share)
    };
    let chords = nodes.windows(2).enumerate().map(on_chord);
    let nearest = chords.min_by(|a, b| a.0.total_cmp(&b.0));
    let mut t = nearest.map_or(0.0, |(_, t)| t);
    let end = nodes.len().saturating_sub(1) as f64;
    for _ in 0..STEPS {
        let (point, derivative) = evaluate(nodes, t);
        let step = (p - point).dot(&derivative) / derivative.norm_squared();
        if step.is_finite() {
            t = (t + step).clamp(0.0, end);
        }
    }
    t
}

/// Whether the last node is the first.
fn is_closed(nodes: &[CurveNode]) -> bool {
    nodes.len() > 2 && nodes.first() == nodes.last()
}

/// The part from one point to another along the curve, all of a closed one between equal points.
/// Its ends are these points.
pub(super) fn clipped(nodes: &[CurveNode], from: &Point3<f64>, to: &Point3<f64>) -> Vec<CurveNode> {
    /// Share of a span below which a node is at the end of the part.
    const AT_NODE: f64 = 1e-6;
    let spans = nodes.len().saturating_sub(1);
    let (begin, mut end) = (parameter(nodes, from), parameter(nodes, to));
    if is_closed(nodes) && (from == to || end <= begin) {
        end += spans as f64;
    }
    let end_node = |t: f64, point: &Point3<f64>| {
        let t = if t > spans as f64 {
            t - spans as f64
        } else {
            t
        };
        CurveNode {
            point: *point,
            tangent: evaluate(nodes, t).1.normalize(),
        }
    };
    let inner = (begin + AT_NODE).ceil() as usize..=(end - AT_NODE).floor().max(0.0) as usize;
    let inner = inner.filter_map(|at| nodes.get(if at >= spans { at - spans } else { at }));
    let ends = [end_node(begin, from), end_node(end, to)];
    [&ends[0]]
        .into_iter()
        .chain(inner)
        .chain([&ends[1]])
        .copied()
        .collect()
}

/// Whether it has a span, and each node is finite with a unit tangent.
pub(super) fn is_sound(nodes: &[CurveNode]) -> bool {
    let is_node =
        |node: &CurveNode| is_finite(&node.point) && (node.tangent.norm() - 1.0).abs() < 1e-9;
    let is_span = |pair: &[CurveNode]| pair[0].point != pair[1].point;
    nodes.len() > 1 && nodes.iter().all(is_node) && nodes.windows(2).all(is_span)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn circle(count: usize) -> Vec<CurveNode> {
        let node = |at: usize| {
            let (sin, cos) = (TAU * (at % count) as f64 / count as f64).sin_cos();
            CurveNode {
                point: Point3::new(cos, sin, 0.0),
                tangent: Vector3::new(-sin, cos, 0.0),
            }
        };
        (0..=count).map(node).collect()
    }

    #[test]
    fn a_part_of_a_closed_curve_runs_over_its_seam() {
        let nodes = circle(64);
        let at = |angle: f64| Point3::new(angle.cos(), angle.sin(), 0.0);
        for (from, to) in [(0.3, 2.0), (5.0, 7.0), (-0.2, 0.2), (1.0, 1.0)] {
            let part = clipped(&nodes, &at(from), &at(to));
            assert_eq!(part.first().map(|node| node.point), Some(at(from)));
            assert_eq!(part.last().map(|node| node.point), Some(at(to)));
            let knots = spline_form(&part).knots;
            let angle = if to > from { to - from } else { TAU };
            let chords = knots.last().unwrap();
            assert!(
                (chords - angle).abs() < 1e-3 * angle,
                "{from} {to}: {chords}"
            );
            assert!(is_sound(&part));
        }
    }

    /// De Boor's recursion over all knots.
    #[test]
    fn the_b_spline_is_the_same_curve() {
        let nodes = circle(12);
        let form = spline_form(&nodes);
        assert_eq!(form.control_points.len(), 2 * nodes.len());
        let last = form.knots.len() - 1;
        let times = |at: usize| if at == 0 || at == last { 4 } else { 2 };
        let knots: Vec<f64> = (0..=last)
            .flat_map(|at| vec![form.knots[at]; times(at)])
            .collect();
        for t in [0.1, 0.3, 1.5, 4.0, 7.9, 11.5f64] {
            let (at, share) = (t as usize, t.fract());
            let u = form.knots[at] + share * (form.knots[at + 1] - form.knots[at]);
            let k = 3 + 2 * at;
            let mut d: Vec<_> = (k - 3..=k).map(|i| form.control_points[i].coords).collect();
            for r in 1..=3 {
                for j in (r..=3).rev() {
                    let i = j + k - 3;
                    let a = (u - knots[i]) / (knots[i + 4 - r] - knots[i]);
                    d[j] = d[j - 1] * (1.0 - a) + d[j] * a;
                }
            }
            let (point, _) = evaluate(&nodes, t);
            assert!((point.coords - d[3]).norm() < 1e-14, "{t}");
            assert!((parameter(&nodes, &point) - t).abs() < 1e-9, "{t}");
        }
    }
}
