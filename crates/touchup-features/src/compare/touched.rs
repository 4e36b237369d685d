//! The touched part of a surface.

use std::collections::HashSet;

use nalgebra::Point3;

use touchup_geometry::numeric::{PointGrid, voxel_of};

/// Distance from a contact to the border of the touched region, m.
const REACH: f64 = 1e-3;
/// Cell size of one kept contact, m: a static ball does not count a thousandfold.
const SPACING: f64 = 0.25e-3;

/// Touched region of a part.
#[derive(Clone, Debug)]
pub struct TouchedRegion {
    contacts: Vec<Point3<f64>>,
    /// indices into `contacts`
    grid: PointGrid,
}

impl TouchedRegion {
    /// The region around touched points of the part, m; non-finite points are left out.
    pub fn of(contacts: impl IntoIterator<Item = Point3<f64>>) -> Self {
        let mut kept = HashSet::new();
        let mut region = Self {
            contacts: Vec::new(),
            grid: PointGrid::new(REACH),
        };
        for contact in contacts
            .into_iter()
            .filter(|contact| contact.coords.iter().all(|x| x.is_finite()))
        {
            if kept.insert(voxel_of(&contact, SPACING)) {
                region.grid.insert(region.contacts.len() as u32, &contact);
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
        self.grid.near(p, REACH).next().is_some()
    }
}
