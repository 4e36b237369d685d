//! The flat pieces of a drawing: connected faces in one plane.

use super::facets::{Facets, NONE};
use touchup_geometry::numeric::flood;

/// Cosine of the maximum angle across an edge inside a region, and of a face's normal from its
/// plane: half of a polygon of 9 sides, 40°.
pub(in crate::features) const SMOOTH: f64 = 0.766;
/// Minimum share of a drawing's faces in one plane with a neighbour.
const DRAWN_SHARE: f64 = 0.2;
/// Tolerance of one plane, 1 − cos: 0.01°, the effect of single precision on small faces.
const COPLANAR: f64 = 1.5e-8;

/// Flat pieces, computed on demand.
#[derive(Clone, Debug)]
pub(in crate::features) struct Flats {
    /// number of the piece of each face, if known
    of_face: Vec<u32>,
    flats: Vec<FlatPiece>,
}

/// A flat piece.
#[derive(Clone, Debug)]
pub(in crate::features) struct FlatPiece {
    pub faces: Vec<u32>,
    /// m²
    pub area: f64,
}

impl Flats {
    /// `None` for a mesh that is no drawing.
    pub(crate) fn of(facets: &Facets) -> Option<Self> {
        is_drawn(facets).then(|| Self {
            of_face: vec![NONE; facets.slots()],
            flats: Vec::new(),
        })
    }

    /// The flat piece of a face.
    pub(crate) fn at(&mut self, facets: &Facets, face: u32) -> &FlatPiece {
        let known = self.of_face[face as usize];
        let number = if known == NONE {
            self.add(facets, face)
        } else {
            known
        };
        &self.flats[number as usize]
    }

    fn add(&mut self, facets: &Facets, seed: u32) -> u32 {
        let (normal, number) = (facets.normal(seed), self.flats.len() as u32);
        self.of_face[seed as usize] = number;
        let beside = |face| facets.beside(face).map(|(_, other)| other);
        let faces = flood(vec![seed], beside, |other| {
            let of_other = &mut self.of_face[other as usize];
            let is_new = *of_other == NONE && 1.0 - normal.dot(&facets.normal(other)) < COPLANAR;
            if is_new {
                *of_other = number;
            }
            is_new
        });
        self.flats.push(FlatPiece {
            area: facets.area_of(&faces),
            faces,
        });
        number
    }
}

impl FlatPiece {
    /// The neighbouring faces that continue it without an edge.
    pub(crate) fn beside<'a>(&'a self, facets: &'a Facets) -> impl Iterator<Item = u32> + 'a {
        let normal = facets.normal(self.faces[0]);
        let beside = self
            .faces
            .iter()
            .flat_map(|&face| facets.beside(face))
            .map(|(_, other)| other);
        beside.filter(move |&other| {
            (COPLANAR..1.0 - SMOOTH).contains(&(1.0 - normal.dot(&facets.normal(other))))
        })
    }
}

/// Whether neighbours are coplanar as in a drawing, unlike in a measurement.
fn is_drawn(facets: &Facets) -> bool {
    let all = facets.areas.iter().filter(|&&area| area > 0.0).count();
    let is_coplanar = |&face: &u32| {
        let is_alike = |other: u32| 1.0 - facets.normal(face).dot(&facets.normal(other)) < COPLANAR;
        facets.area(face) > 0.0 && facets.beside(face).any(|(_, other)| is_alike(other))
    };
    // stops at the needed number
    let enough = (DRAWN_SHARE * all as f64) as usize + 1;
    (0..facets.slots() as u32)
        .filter(is_coplanar)
        .take(enough)
        .count()
        == enough
}
