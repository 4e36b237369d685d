//! Usable points of a cloud.

use std::collections::HashSet;

use nalgebra::{Point3, Vector3};

use super::summary::CloudSummary;
use touchup_geometry::mesh::{PointCloud, ScanStation, coherent_order, is_place};

/// Finite, distinct points along a space-filling curve: consecutive neighbour searches share the
/// cache.
#[derive(Debug)]
pub(super) struct UsablePoints {
    /// m
    pub positions: Vec<Point3<f64>>,
    /// one per point, of any length; or none at all
    pub normals: Vec<Vector3<f64>>,
    /// index into `stations` of each point
    pub station: Vec<u32>,
    pub stations: Vec<ScanStation>,
}

impl UsablePoints {
    /// Usable points of a cloud, with counts of the others.
    pub(crate) fn of(cloud: PointCloud) -> (Self, CloudSummary) {
        let PointCloud {
            positions,
            normals,
            stations,
        } = cloud;
        let mut summary = CloudSummary {
            points: positions.len(),
            ..CloudSummary::default()
        };
        // 0 and −0 are the same coordinate
        let bits = |p: &Point3<f64>| p.coords.map(|x| (x + 0.0).to_bits());
        let mut seen = HashSet::with_capacity(positions.len());
        let mut is_kept = |p: &Point3<f64>| {
            let is_finite = is_place(p);
            let is_new = is_finite && seen.insert(bits(p));
            summary.not_finite += usize::from(!is_finite);
            summary.duplicates += usize::from(is_finite && !is_new);
            is_new
        };
        let kept: Vec<u32> = positions
            .iter()
            .zip(0..)
            .filter(|(p, _)| is_kept(p))
            .map(|(_, at)| at)
            .collect();
        drop(seen);
        let places: Vec<_> = kept.iter().map(|&at| positions[at as usize]).collect();
        let order: Vec<usize> = coherent_order(&places)
            .into_iter()
            .map(|at| kept[at as usize] as usize)
            .collect();
        let station: Vec<u32> = stations
            .iter()
            .zip(0..)
            .flat_map(|(station, at)| std::iter::repeat_n(at, station.points))
            .collect();
        let sorted = Self {
            positions: order.iter().map(|&at| positions[at]).collect(),
            normals: order
                .iter()
                .filter_map(|&at| normals.get(at).copied())
                .collect(),
            station: order.iter().map(|&at| station[at]).collect(),
            stations,
        };
        (sorted, summary)
    }

    /// Scanner position of a point, m, if known.
    pub(crate) fn eye(&self, at: usize) -> Option<Point3<f64>> {
        self.stations[self.station[at] as usize].eye
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_without_a_place_and_points_that_are_there_twice_are_left_out_and_counted() {
        let p = |x| Point3::new(x, 0.0, 0.0);
        let positions = vec![
            p(1.0),
            p(f64::NAN),
            p(1.0),
            p(0.0),
            p(f64::INFINITY),
            p(-0.0),
            p(2.0),
        ];
        let normals = (0..7)
            .map(|i| Vector3::new(f64::from(i), 0.0, 0.0))
            .collect();
        let stations = vec![
            ScanStation::unknown(3),
            ScanStation {
                eye: Some(p(9.0)),
                ..ScanStation::unknown(4)
            },
        ];
        let (points, summary) = UsablePoints::of(PointCloud {
            positions,
            normals,
            stations,
        });
        assert_eq!(points.positions, [p(0.0), p(1.0), p(2.0)]);
        assert_eq!(
            points.normals.iter().map(|n| n.x).collect::<Vec<_>>(),
            [3.0, 0.0, 6.0]
        );
        assert_eq!(
            [0, 1, 2].map(|at| points.eye(at)),
            [Some(p(9.0)), None, Some(p(9.0))]
        );
        assert_eq!(
            [summary.points, summary.not_finite, summary.duplicates],
            [7, 2, 2]
        );
    }
}
