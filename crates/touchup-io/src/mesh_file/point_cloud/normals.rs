//! Normals of the points: a plane through the neighbours of each, turned to the outside.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::cloud::{Cloud, Station};
use super::parallel;
use super::summary::NormalSource;
use touchup_core::mesh::PointTree;

/// Neighbours that a plane is laid through: two rings about a point, and enough that noise of one spacing turns it by a tenth alone.
const PLANE: u32 = 24;
/// Neighbours along which the normals are turned.
const TURNED: u32 = 8;
/// The neighbour by which the spacing is measured …
const RING: usize = 6;
/// … whose distance on an even surface is this many spacings: the circle of that radius, √(6/π), holds six points.
const RING_SPACINGS: f64 = 1.382;

/// What the neighbours of a point say of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Neighbourhood {
    /// unit, of either sign
    pub normal: Vector3<f64>,
    /// distance of neighbouring points, m
    pub spacing: f64,
    /// standard deviation of the neighbours from their plane, m
    pub noise: f64,
}

impl Neighbourhood {
    /// Of every point.
    pub fn of_all(positions: &[Point3<f64>], tree: &PointTree) -> Vec<Self> {
        parallel::map(positions.len(), |at| Self::of(&positions[at], positions, tree))
    }

    fn of(p: &Point3<f64>, positions: &[Point3<f64>], tree: &PointTree) -> Self {
        let near: Vec<_> = tree.nearest(p, PLANE + 1, f64::INFINITY).collect();
        let ring = near.get(RING).or(near.last()).map_or(0.0, |(_, distance)| *distance);
        let count = near.len() as f64;
        let offset = |at: usize| positions[at] - p;
        let mean = near.iter().map(|(at, _)| offset(*at)).sum::<Vector3<f64>>() / count;
        let covariance = near.iter().fold(Matrix3::zeros(), |sum, (at, _)| {
            let from_mean = offset(*at) - mean;
            sum + from_mean * from_mean.transpose()
        });
        // scaled, so that squares of the smallest lengths are numbers still
        let largest = covariance.amax().max(f64::MIN_POSITIVE);
        let planes = (covariance / largest).symmetric_eigen();
        let thinnest = planes.eigenvalues.imin();
        let normal = Unit::try_new(planes.eigenvectors.column(thinnest).into_owned(), 0.0);
        // three numbers of the plane are fitted
        let noise = (planes.eigenvalues[thinnest].max(0.0) * largest / (count - 3.0).max(1.0)).sqrt();
        let normal = normal.map_or(Vector3::z(), Unit::into_inner);
        Self { normal, spacing: ring / RING_SPACINGS, noise }
    }
}

/// A unit normal of each point that points outside, and what says so.
pub(super) fn oriented(cloud: &Cloud, near: &[Neighbourhood], tree: &PointTree) -> (Vec<Vector3<f64>>, NormalSource) {
    let given: Vec<_> = cloud.normals.iter().map_while(|n| n.try_normalize(0.0).filter(is_finite)).collect();
    if given.len() == cloud.positions.len() {
        return (given, NormalSource::File);
    }
    let mut normals: Vec<_> = near.iter().map(|near| near.normal).collect();
    let eyes: Vec<_> = cloud.stations.iter().flat_map(|station| vec![station.eye; station.points]).collect();
    if cloud.stations.iter().all(|Station { eye, is_sure, .. }| eye.is_some() && *is_sure) {
        for ((normal, p), eye) in normals.iter_mut().zip(&cloud.positions).zip(eyes) {
            if eye.is_some_and(|eye| normal.dot(&(eye - p)) < 0.0) {
                normal.neg_mut();
            }
        }
        return (normals, NormalSource::Scanner);
    }
    turn_along_tree(&cloud.positions, &eyes, &mut normals, tree);
    (normals, NormalSource::SpanningTree)
}

fn is_finite(v: &Vector3<f64>) -> bool {
    v.iter().all(|x| x.is_finite())
}

/// Turns the normals so that neighbours agree, along a minimum spanning tree of the neighbours whose cost is 1 − |nᵢ·nⱼ| [Hoppe 1992]; and
/// all of a piece that hangs together so that most look at the scanner or, where it is not known, out of the piece.
fn turn_along_tree(
    positions: &[Point3<f64>],
    eyes: &[Option<Point3<f64>>],
    normals: &mut [Vector3<f64>],
    tree: &PointTree,
) {
    let neighbours = Neighbours::of(positions, tree);
    let mut is_turned = vec![false; positions.len()];
    let mut heap = BinaryHeap::new();
    for start in 0..positions.len() {
        if is_turned[start] {
            continue;
        }
        let mut piece = Vec::new();
        heap.push(Reverse((0, start as u32, start as u32)));
        while let Some(Reverse((_, at, from))) = heap.pop() {
            if std::mem::replace(&mut is_turned[at as usize], true) {
                continue;
            }
            let normal = normals[from as usize];
            if normals[at as usize].dot(&normal) < 0.0 {
                normals[at as usize].neg_mut();
            }
            piece.push(at as usize);
            let normal = normals[at as usize];
            for &next in neighbours.of_point(at as usize) {
                if !is_turned[next as usize] {
                    let cost = (1.0 - normal.dot(&normals[next as usize]).abs()).max(0.0);
                    heap.push(Reverse(((cost * COST_STEPS) as u32, next, at)));
                }
            }
        }
        if !looks_outside(&piece, positions, eyes, normals) {
            piece.iter().for_each(|&at| normals[at].neg_mut());
        }
    }
}

/// Costs are compared as whole numbers, so that their order is the same everywhere.
const COST_STEPS: f64 = 1e9;

/// Whether the normals of a piece look more to the scanner than away, or out of the piece: their flux through a closed surface is thrice
/// its volume.
fn looks_outside(
    piece: &[usize],
    positions: &[Point3<f64>],
    eyes: &[Option<Point3<f64>>],
    normals: &[Vector3<f64>],
) -> bool {
    let votes: f64 = piece.iter().filter_map(|&at| Some(normals[at].dot(&(eyes[at]? - positions[at])).signum())).sum();
    if votes != 0.0 {
        return votes > 0.0;
    }
    let middle = piece.iter().map(|&at| positions[at].coords).sum::<Vector3<f64>>() / piece.len() as f64;
    let [flux, reach] = piece.iter().fold([0.0; 2], |[flux, reach], &at| {
        let from_middle = positions[at].coords - middle;
        [flux + normals[at].dot(&from_middle), reach + from_middle.norm()]
    });
    /// Of a flat piece there is no flux but that of noise; then up is outside, as of a part on a table.
    const FLAT: f64 = 0.02;
    if flux.abs() > FLAT * reach {
        return flux > 0.0;
    }
    let sum: Vector3<f64> = piece.iter().map(|&at| normals[at]).sum();
    sum[sum.iamax()] >= 0.0
}

/// Who is a neighbour of whom, from either side.
struct Neighbours {
    /// where those of a point begin
    first: Vec<u32>,
    points: Vec<u32>,
}

impl Neighbours {
    fn of(positions: &[Point3<f64>], tree: &PointTree) -> Self {
        let nearest = parallel::map(positions.len(), |at| {
            let found = tree.nearest(&positions[at], TURNED + 1, f64::INFINITY);
            found.map(|(other, _)| other as u32).filter(|&other| other as usize != at).collect::<Vec<_>>()
        });
        let pairs = || nearest.iter().enumerate().flat_map(|(at, near)| near.iter().map(move |&other| (at, other)));
        let mut first = vec![0; positions.len() + 1];
        for (at, other) in pairs() {
            first[at + 1] += 1;
            first[other as usize + 1] += 1;
        }
        (1..first.len()).for_each(|at| first[at] += first[at - 1]);
        let mut next = first.clone();
        let mut points = vec![0; first.last().map_or(0, |end| *end as usize)];
        let mut put = |at: usize, other: u32| {
            points[next[at] as usize] = other;
            next[at] += 1;
        };
        for (at, other) in pairs() {
            put(at, other);
            put(other as usize, at as u32);
        }
        Self { first, points }
    }

    fn of_point(&self, at: usize) -> &[u32] {
        &self.points[self.first[at] as usize..self.first[at + 1] as usize]
    }
}
