//! All contacts of a part, with their neighbours.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::contact::{ContactCell, LEAST_WEIGHT, edge_of};
use super::noise::ContactNoise;
use crate::features::segmentation::primitive::Primitive;
use touchup_geometry::numeric::{PointGrid, VoxelKey, voxel_of};
use touchup_method::stylus::ProbedPoint;

/// Size of a cell, in radii of the ball.
const CELL: f64 = 0.25;
/// Cosine between normals in one contact: 25°.
const ALIKE: f64 = 0.906;
/// Distance of neighbours, in radii of the ball: strokes lie closer.
const NEIGHBOURS: f64 = 1.6;
/// Number of nearest neighbours, and of farther ones.
const NEAREST: usize = 12;

/// All contacts, their neighbours and their noise.
pub(super) struct Contacts {
    pub all: Vec<ContactCell>,
    pub beside: Vec<Vec<u32>>,
    pub noise: ContactNoise,
    /// radius of the ball, m
    pub radius: f64,
}

/// The sums of the touches of a contact, by weight.
#[derive(Default)]
struct ContactSum {
    touches: Vec<u32>,
    stroke: u32,
    weight: f64,
    centre: Vector3<f64>,
    point: Vector3<f64>,
    normal: Vector3<f64>,
    radius: f64,
}

impl Contacts {
    pub(super) fn of(touches: &[ProbedPoint]) -> Self {
        let mut cells: BTreeMap<VoxelKey, Vec<usize>> = BTreeMap::new();
        let mut sums: Vec<ContactSum> = Vec::new();
        let sound = (0..)
            .zip(touches)
            .filter(|(_, touch)| !touch.is_rejected && touch.radius > 0.0);
        for (number, touch) in sound {
            let cell = voxel_of(&touch.point, CELL * touch.radius);
            let of_cell = cells.entry(cell).or_default();
            let is_alike = |&&at: &&usize| sums[at].normal.normalize().dot(&touch.normal) > ALIKE;
            let at = of_cell.iter().find(is_alike).copied().unwrap_or_else(|| {
                of_cell.push(sums.len());
                sums.push(ContactSum {
                    stroke: touch.stroke,
                    radius: touch.radius,
                    ..ContactSum::default()
                });
                sums.len() - 1
            });
            sums[at].add(number, touch);
        }
        let all: Vec<ContactCell> = sums.into_iter().map(ContactSum::mean).collect();
        let radius = all.iter().map(|contact| contact.radius).fold(0.0, f64::max);
        let beside = beside(&all, radius);
        let noise = ContactNoise::of(&all, &beside, radius);
        Self {
            all,
            beside,
            noise,
            radius,
        }
    }

    /// The same with places of edges: a ball that rolls over one shows the walls below it.
    ///
    /// - `borders`: surfaces, each with its contacts that lean over an edge.
    pub(super) fn with_edges(
        self,
        touches: &[ProbedPoint],
        borders: &[(Primitive, Vec<u32>)],
    ) -> Self {
        let mut all = self.all;
        for (surface, leaning) in borders {
            for &at in leaning {
                all.extend(edge_of(&all[at as usize], touches, surface));
            }
        }
        let beside = beside(&all, self.radius);
        Self {
            all,
            beside,
            ..self
        }
    }
}

impl ContactSum {
    fn add(&mut self, number: u32, touch: &ProbedPoint) {
        let weight = touch.weight.max(LEAST_WEIGHT);
        self.touches.push(number);
        self.weight += weight;
        self.centre += touch.centre.coords * weight;
        self.point += touch.point.coords * weight;
        self.normal += touch.normal * weight;
    }

    fn mean(self) -> ContactCell {
        ContactCell {
            touches: self.touches,
            stroke: self.stroke,
            centre: Point3::from(self.centre / self.weight),
            point: Point3::from(self.point / self.weight),
            normal: self.normal.normalize(),
            radius: self.radius,
            slack: 1.0,
            land: None,
        }
    }
}

/// Neighbours of each contact.
fn beside(all: &[ContactCell], radius: f64) -> Vec<Vec<u32>> {
    let reach = NEIGHBOURS * radius;
    let mut grid = PointGrid::new(reach);
    (0..)
        .zip(all)
        .for_each(|(at, contact)| grid.insert(at, &contact.point));
    let neighbours = |at: usize| {
        let place = &all[at].point;
        // bits of numbers from 0 on are in their order
        let distance = |other: &u32| {
            (all[*other as usize].point - place)
                .norm_squared()
                .to_bits()
        };
        let near = grid.near(place, reach).filter(|&other| other != at);
        let mut near: Vec<u32> = near.map(|other| other as u32).collect();
        near.sort_by_cached_key(distance);
        let far = near.split_off(near.len().min(NEAREST));
        near.extend(far.iter().step_by(far.len().div_ceil(NEAREST).max(1)));
        near.sort_unstable();
        near
    };
    (0..all.len()).map(neighbours).collect()
}
