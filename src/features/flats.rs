//! The flat pieces of a drawing: faces that lie in one plane and hang together.

use super::facets::Facets;
use super::grow::SMOOTH;
use super::segment::Segmentation;

/// A mesh is a drawing when this share of its faces lies in one plane with a neighbour …
const DRAWN_SHARE: f64 = 0.2;
/// … within this, 1 − cos: 0.01°, what single precision makes of small faces.
const COPLANAR: f64 = 1.5e-8;

/// All flat pieces.
#[derive(Clone, Debug)]
pub(super) struct Flats {
    /// number of the piece of each face
    of_face: Vec<u32>,
    flats: Vec<Flat>,
}

/// A flat piece, and in what it goes on without an edge.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Flat {
    /// one of its faces
    pub face: u32,
    /// how many it has
    pub faces: usize,
    /// m²
    pub area: f64,
    /// the largest face beside it, m²
    pub face_beside: f64,
    /// the largest flat piece beside it, m²
    pub flat_beside: f64,
}

impl Flats {
    pub fn of(facets: &Facets) -> Self {
        let mut flats = Self { of_face: vec![Segmentation::NONE; facets.slots()], flats: Vec::new() };
        for (face, _) in facets.mesh.faces() {
            if flats.of_face[face.0 as usize] == Segmentation::NONE {
                flats.add(facets, face.0);
            }
        }
        flats.look_beside(facets);
        flats
    }

    fn add(&mut self, facets: &Facets, seed: u32) {
        let (normal, number) = (facets.normal(seed), self.flats.len() as u32);
        self.of_face[seed as usize] = number;
        let (mut faces, mut at) = (vec![seed], 0);
        while at < faces.len() {
            for (_, other) in facets.beside(faces[at]) {
                let is_free = self.of_face[other as usize] == Segmentation::NONE;
                if is_free && 1.0 - normal.dot(&facets.normal(other)) < COPLANAR {
                    self.of_face[other as usize] = number;
                    faces.push(other);
                }
            }
            at += 1;
        }
        self.flats.push(Flat { face: seed, faces: faces.len(), area: facets.area_of(&faces), ..Flat::default() });
    }

    fn look_beside(&mut self, facets: &Facets) {
        for (face, _) in facets.mesh.faces() {
            let number = self.of_face[face.0 as usize];
            for (_, other) in facets.beside(face.0) {
                let beside = self.of_face[other as usize];
                if beside != number && facets.normal(face.0).dot(&facets.normal(other)) > SMOOTH {
                    let area = self.flats[beside as usize].area;
                    let flat = &mut self.flats[number as usize];
                    flat.face_beside = flat.face_beside.max(facets.area(other));
                    flat.flat_beside = flat.flat_beside.max(area);
                }
            }
        }
    }

    /// That of a face.
    pub fn at(&self, face: u32) -> Flat {
        self.flats[self.of_face[face as usize] as usize]
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = Flat> + '_ {
        self.flats.iter().copied()
    }
}

/// Whether neighbours lie in one plane as they do in a drawing, and in no measurement.
pub(super) fn is_drawn(facets: &Facets) -> bool {
    let all = facets.areas.iter().filter(|&&area| area > 0.0).count();
    let is_coplanar = |&face: &u32| {
        let is_alike = |other: u32| 1.0 - facets.normal(face).dot(&facets.normal(other)) < COPLANAR;
        facets.area(face) > 0.0 && facets.beside(face).any(|(_, other)| is_alike(other))
    };
    // no more are looked at than it takes
    let enough = (DRAWN_SHARE * all as f64) as usize + 1;
    (0..facets.slots() as u32).filter(is_coplanar).take(enough).count() == enough
}
