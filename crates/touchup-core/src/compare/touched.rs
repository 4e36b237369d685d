//! The part of a surface that was touched.

use std::collections::{HashMap, HashSet};

use nalgebra::Point3;

use crate::numeric::{VoxelKey, voxel_neighbourhood, voxel_of};

/// A place belongs to the touched region when a contact is within this distance, m.
const REACH: f64 = 1e-3;
/// One contact is kept in each cell of this size, m: a ball that rests does not count a thousandfold.
const SPACING: f64 = 0.25e-3;

/// Where a ball touched a part.
#[derive(Clone, Debug, Default)]
pub struct TouchedRegion {
    contacts: Vec<Point3<f64>>,
    /// indices into `contacts` by cells of [`REACH`]
    cells: HashMap<VoxelKey, Vec<usize>>,
}

impl TouchedRegion {
    /// The region around points of the part, m, that were touched; what is not finite is left out.
    pub fn of(contacts: impl IntoIterator<Item = Point3<f64>>) -> Self {
        let mut kept = HashSet::new();
        let mut region = Self::default();
        for contact in contacts.into_iter().filter(|contact| contact.coords.iter().all(|x| x.is_finite())) {
            if kept.insert(voxel_of(&contact, SPACING)) {
                region.cells.entry(voxel_of(&contact, REACH)).or_default().push(region.contacts.len());
                region.contacts.push(contact);
            }
        }
        region
    }

    /// The contacts, m, in order of time, thinned out to one in a quarter of a millimetre.
    pub fn contacts(&self) -> &[Point3<f64>] {
        &self.contacts
    }

    /// Whether a contact is within a millimetre of `p` (m).
    pub fn is_near(&self, p: &Point3<f64>) -> bool {
        let mut near = voxel_neighbourhood(voxel_of(p, REACH)).filter_map(|voxel| self.cells.get(&voxel)).flatten();
        near.any(|&i| (self.contacts[i] - p).norm() <= REACH)
    }
}
