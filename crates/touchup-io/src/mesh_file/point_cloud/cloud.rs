//! Points as read, and what of them is of use.

use std::collections::HashSet;

use nalgebra::{Point3, Vector3};

use super::summary::CloudSummary;
use touchup_core::mesh::is_place;

/// Points of a scan in the order of the file.
#[derive(Debug, Default)]
pub(in super::super) struct Cloud {
    /// m, in the file's own frame; NaN and infinity are allowed
    pub positions: Vec<Point3<f64>>,
    /// of each point, any length; none at all where the file has none
    pub normals: Vec<Vector3<f64>>,
    /// whose points follow one another
    pub stations: Vec<Station>,
}

/// Points that were scanned from one place.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Station {
    /// how many of the points are of it
    pub points: usize,
    /// where the scanner stood, m; `None`: the file does not say
    pub eye: Option<Point3<f64>>,
    /// whether it saw every point from there; else the place may be a mere default
    pub is_sure: bool,
}

impl Cloud {
    /// Without the points that are not finite or are there already.
    pub fn cleaned(mut self) -> (Self, CloudSummary) {
        let mut summary = CloudSummary { points: self.positions.len(), ..CloudSummary::default() };
        // 0 and −0 are one place
        let bits = |p: &Point3<f64>| p.coords.map(|x| (x + 0.0).to_bits());
        let mut seen = HashSet::with_capacity(self.positions.len());
        let mut keep = |p: &Point3<f64>| {
            let is_finite = is_place(p);
            let is_new = is_finite && seen.insert(bits(p));
            summary.not_finite += usize::from(!is_finite);
            summary.duplicates += usize::from(is_finite && !is_new);
            is_new
        };
        let kept: Vec<bool> = self.positions.iter().map(&mut keep).collect();
        let mut first = 0;
        for station in &mut self.stations {
            let next = first + station.points;
            station.points = kept[first..next].iter().filter(|kept| **kept).count();
            first = next;
        }
        let mut flags = kept.iter();
        self.positions.retain(|_| flags.next() == Some(&true));
        let mut flags = kept.iter();
        self.normals.retain(|_| flags.next() == Some(&true));
        (self, summary)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_without_a_place_and_points_that_are_there_twice_are_left_out_and_counted() {
        let p = |x| Point3::new(x, 0.0, 0.0);
        let positions = vec![p(1.0), p(f64::NAN), p(1.0), p(0.0), p(f64::INFINITY), p(-0.0), p(2.0)];
        let normals = (0..7).map(|i| Vector3::new(f64::from(i), 0.0, 0.0)).collect();
        let station = |points| Station { points, eye: None, is_sure: false };
        let (cloud, summary) = Cloud { positions, normals, stations: vec![station(3), station(4)] }.cleaned();
        assert_eq!(cloud.positions, [p(1.0), p(0.0), p(2.0)]);
        assert_eq!(cloud.normals.iter().map(|n| n.x).collect::<Vec<_>>(), [0.0, 3.0, 6.0]);
        assert_eq!(cloud.stations.iter().map(|s| s.points).collect::<Vec<_>>(), [1, 2]);
        assert_eq!([summary.points, summary.not_finite, summary.duplicates], [7, 2, 2]);
    }
}
