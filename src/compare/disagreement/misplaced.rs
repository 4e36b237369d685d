//! How far the scan as a whole lies off the touches: a small rigid motion, and what it is too fat everywhere.
//!
//! At a place x with the normal n touch − scan is b + n·s + ((x − c) × n)·θ; b, s and θ by least squares with Tukey's
//! weights, s and θ held back a little, so that what nothing tells goes to b.

use nalgebra::{Point3, SMatrix, SVector, Vector3};

use super::Places;

/// The scan against the touches, of small angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misplaced {
    /// shift that would bring the scan onto the touches, m, at `centre`
    pub shift: Vector3<f64>,
    /// and rotation vector, rad
    pub turn: Vector3<f64>,
    /// middle of the touched places, m
    pub centre: Point3<f64>,
}

/// Rounds of weights.
const ROUNDS: usize = 10;
/// Width of Tukey's weights in standard deviations.
const WIDTH: f64 = 4.685;
/// Standard deviation of normal errors over their median.
const SIGMA_OF_MEDIAN: f64 = 1.4826;
/// By which share of the weight of all places shift and turn are held back.
const HELD_BACK: f64 = 0.03;

impl Misplaced {
    /// Of the open places; `None` where they tell nothing.
    pub(super) fn of(places: &Places) -> Option<Self> {
        let open: Vec<usize> = (0..places.off.len()).filter(|&at| places.is_open[at]).collect();
        let count = open.len() as f64;
        let sum: Vector3<f64> = open.iter().map(|&at| places.positions[at].coords).sum();
        let centre = Point3::from(sum / count);
        let square: f64 = open.iter().map(|&at| (places.positions[at] - centre).norm_squared()).sum();
        let lever = (square / count).sqrt();
        let row = |at: usize| {
            let (n, arm) = (places.normals[at], (places.positions[at] - centre) / lever);
            let turn = arm.cross(&n);
            SVector::<f64, 7>::from([1.0, n.x, n.y, n.z, turn.x, turn.y, turn.z])
        };
        let mut x = SVector::<f64, 7>::zeros();
        let mut width = f64::INFINITY;
        for _ in 0..ROUNDS {
            let (mut normal, mut right, mut weights) = (SMatrix::<f64, 7, 7>::zeros(), SVector::<f64, 7>::zeros(), 0.0);
            let mut sizes = Vec::with_capacity(open.len());
            for &at in &open {
                let row = row(at);
                let left = places.off[at] - row.dot(&x);
                sizes.push(left.abs());
                let weight = (1.0 - (left / width).powi(2)).max(0.0).powi(2) * places.areas[at];
                normal += row * row.transpose() * weight;
                right += row * (places.off[at] * weight);
                weights += weight;
            }
            (1..7).for_each(|i| normal[(i, i)] += HELD_BACK * weights);
            x = normal.cholesky()?.solve(&right);
            let middle = sizes.len() / 2;
            width = WIDTH * SIGMA_OF_MEDIAN * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
            if width <= 0.0 {
                break;
            }
        }
        let is_finite = x.iter().all(|x| x.is_finite());
        let (shift, turn) = (Vector3::new(x[1], x[2], x[3]), Vector3::new(x[4], x[5], x[6]) / lever);
        is_finite.then_some(Self { shift, turn, centre })
    }

    /// What of touch − scan it explains at a place, m.
    pub(super) fn at(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        normal.dot(&(self.shift + self.turn.cross(&(p - self.centre))))
    }
}
