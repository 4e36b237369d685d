//! Segmentation of a mesh into planes and cylinders; spheres follow from their pieces, and cones
//! beside holes once those are known.
//!
//! From the flattest faces on, each free face is the seed of a region: a plane or a cylinder fitted
//! to the faces around it grows over neighbours with corners on it and like normals. A plane that
//! ends without an edge may be a strip of a round surface: then the larger region counts.

use super::facets::{Facets, NONE};
use super::flats::{FlatPiece, Flats, SMOOTH};
use super::marks::sort;
use super::primitive::{NormalSpread, Primitive, belongs, cylinder_of, plane_of, refined};
use super::segment::{Segment, Segmentation};
use touchup_geometry::numeric::median;

/// Characteristic lengths of a mesh.
#[derive(Clone, Copy, Debug)]
pub(in crate::features) struct MeshScale {
    /// diagonal of the box around all, m
    pub diagonal: f64,
    /// median length of an edge, m
    pub edge: f64,
}

/// Rounding of coordinates in single precision, in diagonals.
pub(in crate::features) const ROUNDING: f64 = 1e-6;
/// Minimum distance of facets from their surface that counts, in roundings of a file.
pub(in crate::features) const SEEN_FACETS: f64 = 10.0;
/// Waves of an otherwise good surface, in median edges.
const WAVES: f64 = 0.05;
/// Maximum waves, in diagonals of the mesh.
const WAVES_OF_ALL: f64 = 3e-4;
/// Ratio of successive tolerances.
const WIDER: f64 = 3.0;
/// Number of tolerances.
const RUNGS: i32 = 3;
/// Maximum distance of a corner, in root mean squares of the faces around the seed.
pub(super) const SPREAD: f64 = 4.0;
/// Maximum tolerance of a round surface, in its radii.
pub(super) const SHARPNESS: f64 = 0.08;
/// Maximum number of faces in the fit of a plane while it grows.
const MOST_OF_PLANE: usize = 20_000;
/// Motion of a converged primitive, as a share of the tolerance.
const SETTLED: f64 = 0.1;
/// Number of faces in the test of convergence.
const SAMPLE: usize = 64;
/// Minimum width of a region, in tolerances.
const LEAST_WIDTH: f64 = 12.0;
/// Minimum share of a segment that stronger ones leave.
const LEAST_LEFT: f64 = 0.3;
/// Number of faces around a seed at first.
const NEAR: usize = 16;
/// Root mean square of the normals' sines around a flat seed: 5°.
const FLAT: f64 = 0.09;
/// Minimum area of a flat piece that continues in round ones, in areas of their facets.
const FLAT_AMONG_ROUND: f64 = 20.0;
/// Minimum area of it, in areas of neighbouring flat pieces, which may be round.
const FLAT_BESIDE_FLAT: f64 = 5.0;
/// Minimum root mean square around the seed of a cylinder: 5°, as over 17° of its turn.
const BENT: f64 = 0.09;
/// Maximum smooth share of the border of a region that is a plane without further tests.
const BOUNDED: f64 = 0.2;
/// Minimum area of a curved surface, in areas of the plane in its place.
const MORE: f64 = 1.3;
/// Numbers of faces around the seed of a curved surface, in turn.
const CURVED_NEAR: [usize; 3] = [12, 32, 90];
/// Initial capacity for faces around a seed.
const USUAL_NEAR: usize = 100;
/// Maximum number of examined faces beyond a plane.
const MOST_NEAR: usize = 50_000;
/// Maximum number of fitted faces of them.
const MOST_FITTED: usize = 300;

impl Segmentation {
    /// Parts a mesh.
    pub(in crate::features) fn of(facets: &Facets, scale: MeshScale) -> Self {
        let mut growing = RegionGrower::of(facets, scale);
        let mut seeds = growing.seeds();
        let mut flats = Flats::of(facets);
        for (closeness, tolerance) in growing.scale.tolerances(flats.is_some()) {
            (growing.closeness, growing.tolerance) = (closeness, tolerance);
            seeds.retain(|&face| growing.is_free(face) && facets.area(face) > 0.0);
            for &face in &seeds {
                if growing.is_free(face) && growing.needs[face as usize] <= closeness {
                    growing.grow_from(face, flats.as_mut());
                }
            }
            if let Some(flats) = flats.as_mut().filter(|_| growing.is_exact()) {
                growing.take_flat(&seeds, flats);
            }
        }
        growing.finish()
    }
}

struct RegionGrower<'a> {
    facets: &'a Facets<'a>,
    scale: MeshScale,
    of_face: Vec<u32>,
    segments: Vec<Segment>,
    /// the round in which a face was last examined
    seen: Vec<u32>,
    round: u32,
    /// tolerance that a region from each face needs, if known, m
    needs: Vec<f64>,
    /// maximum distance of the faces around a seed in this round, m
    closeness: f64,
    /// maximum distance of the other faces, m
    tolerance: f64,
}

impl<'a> RegionGrower<'a> {
    fn of(facets: &'a Facets<'a>, scale: MeshScale) -> Self {
        let slots = facets.slots();
        Self {
            facets,
            scale,
            of_face: vec![NONE; slots],
            segments: Vec::new(),
            seen: vec![0; slots],
            round: 0,
            needs: vec![0.0; slots],
            closeness: 0.0,
            tolerance: 0.0,
        }
    }

    /// Faces ordered by the flatness of their surroundings, then by id.
    fn seeds(&self) -> Vec<u32> {
        let mut buckets: [Vec<u32>; 16] = Default::default();
        for (face, normal) in self.facets.normals.iter().enumerate() {
            let turns = self
                .facets
                .beside(face as u32)
                .map(|(_, other)| 1.0 - normal.dot(&self.facets.normal(other)));
            let sharpest = turns.fold(0.0, f64::max);
            // 1 − cos: a bucket for each power of two above a thousandth of a degree
            let at = power_of_two((sharpest / 1.5e-10).max(1.0)) / 2;
            buckets[at.min(buckets.len() - 1)].push(face as u32);
        }
        buckets.concat()
    }

    /// Free faces around `seed`, connected over smooth edges, the nearest first.
    fn near(&mut self, seed: u32, most: usize) -> Vec<u32> {
        self.round += 1;
        // all neighbours of the last face may come
        let mut found = Vec::with_capacity(most.min(USUAL_NEAR) + 2);
        found.push(seed);
        self.seen[seed as usize] = self.round;
        let mut at = 0;
        while at < found.len() && found.len() < most {
            let face = found[at];
            at += 1;
            for (_, other) in self.facets.beside(face) {
                let is_new = self.seen[other as usize] != self.round && self.is_free(other);
                if is_new && self.facets.normal(face).dot(&self.facets.normal(other)) > SMOOTH {
                    self.seen[other as usize] = self.round;
                    found.push(other);
                }
            }
        }
        found
    }

    fn is_free(&self, face: u32) -> bool {
        self.of_face[face as usize] == NONE
    }

    fn grow_from(&mut self, seed: u32, flats: Option<&mut Flats>) {
        let near = self.near(seed, NEAR);
        let Some(bend) = NormalSpread::of(self.facets, &near) else {
            return;
        };
        let mut needs = f64::INFINITY;
        let mut best = None;
        if bend.spread < FLAT {
            best = self.plane_from(seed, &near, &mut needs);
        }
        if let Some(flats) = flats.filter(|_| best.is_none() && self.is_exact()) {
            best = self.flat_from(flats.at(self.facets, seed));
        }
        let is_bounded = best
            .as_ref()
            .is_some_and(|plane| self.smooth_share(plane) < BOUNDED);
        if !is_bounded {
            let enough = best.as_ref().map_or(0.0, |plane| MORE * plane.area);
            let faces = best.as_ref().map_or(0, |plane| plane.faces.len());
            let is_more = |curved: &Segment| curved.area > enough;
            let mut curved = self.cylinder_from(seed, faces, &mut needs).filter(is_more);
            if curved.is_none() && faces > 0 && self.is_exact() {
                // facets of a further divided drawing lie off the circle
                let exact = (self.closeness, self.tolerance);
                (self.closeness, self.tolerance) = self.scale.divided();
                curved = self.cylinder_from(seed, faces, &mut needs).filter(is_more);
                (self.closeness, self.tolerance) = exact;
            }
            best = curved.or(best);
        }
        match best.filter(|best| self.is_wide(best)) {
            Some(region) => self.accept(region),
            // a failed seed gets another trial with more tolerance
            None => {
                let needs = needs.max(self.closeness * (1.0 + f64::EPSILON));
                near.iter()
                    .for_each(|&face| self.needs[face as usize] = needs);
            }
        }
    }

    fn accept(&mut self, mut region: Segment) {
        sort(&mut region.faces, self.of_face.len());
        region
            .faces
            .iter()
            .for_each(|&face| self.of_face[face as usize] = self.segments.len() as u32);
        self.segments.push(region);
    }

    fn plane_from(&mut self, seed: u32, near: &[u32], needs: &mut f64) -> Option<Segment> {
        let start = plane_of(
            self.facets,
            self.facets.triangle(seed)[0],
            near.iter().copied(),
        )?;
        self.is_close(&start, near, needs).then_some(())?;
        self.grown(seed, start, near.len())
    }

    /// Whether this round takes exact surfaces of a drawing alone.
    fn is_exact(&self) -> bool {
        self.tolerance <= self.scale.exact()
    }

    /// A flat piece of a drawing that continues in round ones, if much larger than their facets.
    fn flat_from(&mut self, flat: &FlatPiece) -> Option<Segment> {
        let (facets, seed) = (self.facets, flat.faces[0]);
        let largest = flat
            .beside(facets)
            .map(|face| facets.area(face))
            .fold(0.0, f64::max);
        if flat.area <= FLAT_AMONG_ROUND * largest {
            return None;
        }
        let start = plane_of(facets, facets.triangle(seed)[0], std::iter::once(seed))?;
        self.grown(seed, start, flat.faces.len())
    }

    /// Takes the flat pieces of a drawing that remain between its round ones: neighbours may have
    /// kept a seed from its trial.
    fn take_flat(&mut self, seeds: &[u32], flats: &mut Flats) {
        for &seed in seeds {
            if !self.is_free(seed) {
                continue;
            }
            let flat = flats.at(self.facets, seed);
            // each once
            if flat.faces.len() < 2 || flat.faces[0] != seed {
                continue;
            }
            let flat = flat.clone();
            // in a further divided round surface the neighbours are as large
            let is_large =
                |face: u32| FLAT_BESIDE_FLAT * flats.at(self.facets, face).area > flat.area;
            if flat.beside(self.facets).any(is_large) {
                continue;
            }
            if let Some(region) = self.flat_from(&flat).filter(|region| self.is_wide(region)) {
                self.accept(region);
            }
        }
    }

    fn is_wide(&self, region: &Segment) -> bool {
        region.area > (LEAST_WIDTH * self.tolerance).powi(2)
    }

    /// The largest cylinder through the faces around a seed.
    ///
    /// - `plane`: number of faces of the plane there.
    fn cylinder_from(&mut self, seed: u32, plane: usize, needs: &mut f64) -> Option<Segment> {
        let mut best: Option<Segment> = None;
        let (mut before, mut is_all) = (0, false);
        for most in CURVED_NEAR
            .into_iter()
            .chain([(3 * plane + 24).min(MOST_NEAR)])
        {
            if is_all || most <= before {
                continue;
            }
            let near = self.near(seed, most);
            is_all = near.len() < most;
            if near.len() <= before {
                continue;
            }
            before = near.len();
            let near: Vec<u32> = near
                .into_iter()
                .step_by(before.div_ceil(MOST_FITTED))
                .collect();
            let bend = NormalSpread::of(self.facets, &near).filter(|bend| bend.spread > BENT);
            let Some(axis) = bend.and_then(|bend| bend.cylinder_axis()) else {
                continue;
            };
            let start = cylinder_of(self.facets, &near, &axis);
            let Some(start) = start.and_then(|start| refined(&start, self.facets, &near)) else {
                continue;
            };
            if !self.is_close(&start, &near, needs) {
                continue;
            }
            let Some(region) = self.grown(seed, start, before) else {
                continue;
            };
            // any facet lies on some cylinder
            if NormalSpread::of(self.facets, &region.faces).is_none_or(|bend| bend.spread < BENT) {
                continue;
            }
            if best.as_ref().is_none_or(|best| region.area > best.area) {
                best = Some(region);
            }
        }
        best
    }

    /// Whether the corners of `near` are within the tolerance; else lowers `needs` to their need.
    fn is_close(&self, primitive: &Primitive, near: &[u32], needs: &mut f64) -> bool {
        let squares = near
            .iter()
            .flat_map(|&face| self.facets.triangle(face))
            .map(|p| primitive.distance(&p).powi(2));
        let needed = SPREAD * (squares.sum::<f64>() / (3 * near.len()) as f64).sqrt();
        *needs = needs.min(needed);
        needed <= self.closeness
    }

    /// The region around `seed` that a primitive explains, and the primitive through all of it.
    ///
    /// - `near`: number of faces around the seed behind the primitive.
    fn grown(&mut self, seed: u32, start: Primitive, near: usize) -> Option<Segment> {
        let mut primitive = start;
        let mut faces = Vec::new();
        for _ in 0..2 {
            if !belongs(self.facets, seed, &primitive, self.tolerance) {
                return None;
            }
            faces = self.flood(vec![seed], &mut primitive, near);
            let used = primitive;
            primitive = self.fitted(&used, &faces)?;
            if used.plane().is_some() && self.is_settled(&used, &primitive, &faces) {
                break;
            }
        }
        if matches!(primitive, Primitive::Cylinder(wall) if self.closeness > SHARPNESS * wall.radius)
        {
            return None;
        }
        let area = self.facets.area_of(&faces);
        let (tolerance, is_exact) = (self.tolerance, self.is_exact());
        Some(Segment {
            primitive,
            faces,
            area,
            tolerance,
            is_exact,
            felt: Vec::new(),
        })
    }

    /// Grows from the faces of `found` over all that belong to the primitive, with a new fit each
    /// time their number has doubled.
    ///
    /// - `fitted`: number of faces that already determine the primitive; fewer of them may be flat
    ///   by themselves.
    fn flood(&mut self, mut found: Vec<u32>, primitive: &mut Primitive, fitted: usize) -> Vec<u32> {
        self.round += 1;
        found
            .iter()
            .for_each(|&face| self.seen[face as usize] = self.round);
        let (mut at, mut refit_at) = (0, 2 * found.len().max(fitted));
        while at < found.len() {
            let face = found[at];
            at += 1;
            for (_, other) in self.facets.beside(face) {
                if self.seen[other as usize] == self.round || !self.is_free(other) {
                    continue;
                }
                self.seen[other as usize] = self.round;
                if belongs(self.facets, other, primitive, self.tolerance) {
                    found.push(other);
                }
            }
            if found.len() >= refit_at {
                refit_at *= 2;
                if let Some(better) = self.fitted(primitive, &found) {
                    *primitive = better;
                }
            }
        }
        found
    }

    /// Whether two primitives are the same on a sample of faces, within the tolerance.
    fn is_settled(&self, one: &Primitive, other: &Primitive, faces: &[u32]) -> bool {
        faces
            .iter()
            .step_by(faces.len().div_ceil(SAMPLE))
            .all(|&face| {
                let p = self.facets.triangle(face)[0];
                (one.distance(&p) - other.distance(&p)).abs() < SETTLED * self.tolerance
            })
    }

    fn fitted(&self, primitive: &Primitive, faces: &[u32]) -> Option<Primitive> {
        let Some(plane) = primitive.plane() else {
            return refined(primitive, self.facets, faces);
        };
        let step = faces.len().div_ceil(MOST_OF_PLANE);
        plane_of(
            self.facets,
            plane.point(),
            faces.iter().copied().step_by(step),
        )
    }

    /// Share of a region's border without an edge.
    fn smooth_share(&mut self, region: &Segment) -> f64 {
        self.round += 1;
        region
            .faces
            .iter()
            .for_each(|&face| self.seen[face as usize] = self.round);
        let (mut smooth, mut all) = (0.0, f64::MIN_POSITIVE);
        for &face in &region.faces {
            for edge in 0..3 {
                let other = self.facets.beside[face as usize][edge];
                if other != NONE && self.seen[other as usize] == self.round {
                    continue;
                }
                let [a, b] = self.facets.edge(face, edge);
                let length = (a - b).norm();
                all += length;
                let goes_on =
                    |other: u32| self.facets.normal(face).dot(&self.facets.normal(other)) > SMOOTH;
                if other != NONE && goes_on(other) {
                    smooth += length;
                }
            }
        }
        smooth / all
    }

    /// Parts the mesh once more: tight and large segments take over their faces in loose and small
    /// ones.
    fn claim(&mut self) {
        let mut order = std::mem::take(&mut self.segments);
        order.sort_by(|a, b| {
            a.tolerance
                .total_cmp(&b.tolerance)
                .then(b.area.total_cmp(&a.area))
        });
        self.of_face.fill(NONE);
        for segment in order {
            self.tolerance = segment.tolerance;
            let mut left: Vec<u32> = segment
                .faces
                .iter()
                .copied()
                .filter(|&face| self.is_free(face))
                .collect();
            if left.is_empty() {
                continue;
            }
            let is_whole = left.len() == segment.faces.len();
            let primitive = if is_whole {
                Some(segment.primitive)
            } else {
                self.fitted(&segment.primitive, &left)
            };
            let Some(mut primitive) = primitive else {
                continue;
            };
            left.retain(|&face| belongs(self.facets, face, &primitive, self.tolerance));
            let fitted = left.len();
            let faces = self.flood(left, &mut primitive, fitted);
            let area = self.facets.area_of(&faces);
            if area < LEAST_LEFT * segment.area || area < (LEAST_WIDTH * self.tolerance).powi(2) {
                continue;
            }
            let primitive = self.fitted(&primitive, &faces).unwrap_or(primitive);
            self.accept(Segment {
                primitive,
                faces,
                area,
                ..segment
            });
        }
    }

    fn finish(mut self) -> Segmentation {
        self.claim();
        let Self {
            mut segments,
            mut of_face,
            ..
        } = self;
        segments.sort_by(|a, b| b.area.total_cmp(&a.area));
        for (number, segment) in segments.iter().enumerate() {
            segment
                .faces
                .iter()
                .for_each(|&face| of_face[face as usize] = number as u32);
        }
        Segmentation { segments, of_face }
    }
}

/// Exponent of the largest power of two up to `x`, from 1 on.
fn power_of_two(x: f64) -> usize {
    (x.to_bits() >> (f64::MANTISSA_DIGITS - 1)) as usize - (f64::MAX_EXP - 1) as usize
}

impl MeshScale {
    /// The edge is the median over a sample of the first edges of faces.
    pub(in crate::features) fn of(facets: &Facets) -> Self {
        let [lo, hi] = facets.mesh.bounds();
        let count = facets.slots();
        let sample = (0..count)
            .step_by((count / 10_000).max(1))
            .filter(|&face| facets.areas[face] > 0.0);
        let edges = sample.map(|face| facets.edge(face as u32, 0));
        let mut lengths: Vec<f64> = edges.map(|[a, b]| (b - a).norm()).collect();
        Self {
            diagonal: (hi - lo).norm(),
            edge: median(&mut lengths).unwrap_or(0.0),
        }
    }

    /// Maximum distances of the faces around a seed, and of the other faces. Tight ones first:
    /// loose ones must not take their faces.
    ///
    /// - `is_drawn`: whether neighbours are coplanar as in a drawing.
    fn tolerances(&self, is_drawn: bool) -> Vec<(f64, f64)> {
        let (exact, (closeness, tolerance)) = (self.exact(), self.waves());
        let wider = |rung| f64::powi(WIDER, rung);
        let loose = (0..RUNGS).map(|rung| (closeness * wider(rung), tolerance * wider(rung)));
        is_drawn
            .then_some((exact, exact))
            .into_iter()
            .chain(loose)
            .collect()
    }

    /// The same for spheres: a drawing's are exact, and of a scan no more than waves count.
    pub(super) fn of_spheres(&self, is_drawn: bool) -> Vec<(f64, f64)> {
        let mut tolerances = self.tolerances(is_drawn);
        tolerances.truncate(if is_drawn { 1 } else { 2 });
        tolerances
    }

    /// Tolerance of a drawing, m.
    fn exact(&self) -> f64 {
        ROUNDING * self.diagonal
    }

    /// Distance of a drawing's facets from a round surface with corners on its chords, m.
    pub(in crate::features) fn chords(&self) -> f64 {
        WAVES_OF_ALL * self.diagonal
    }

    /// Tolerances of a further divided drawing.
    fn divided(&self) -> (f64, f64) {
        (self.chords(), WIDER * self.chords())
    }

    /// Tolerances of good surfaces off a drawing.
    fn waves(&self) -> (f64, f64) {
        let closeness = (WAVES * self.edge)
            .min(WAVES_OF_ALL * self.diagonal)
            .max(self.exact());
        (closeness, WIDER * closeness)
    }
}
