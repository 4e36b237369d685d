//! Curvature at the vertices of a mesh.
//!
//! Gaussian: the angle defect 2π − Σθ over the angles θ at the vertex is its integral over the
//! vertex's part of the surface; over a closed mesh the defects sum to 2πχ (Gauss and Bonnet),
//! whatever the density. Mean: half the gradient of the area when the vertex moves along its normal
//! is the integral of H; it is positive on bumps and negative in depressions, which the Gaussian
//! curvature does not distinguish.
//!
//! The area is the mixed Voronoi area of \[Meyer et al. 2003\]: with it a ring of acute triangles
//! inscribed in a sphere has K = 1/r² to second order in its edges, whatever its shape.
//! (Barycentric areas have that only for regular rings.)

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};

use touchup_geometry::mesh::{TriMesh, VertexId};

/// Arrangement of the faces around a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VertexKind {
    /// One closed fan, all faces with the same orientation.
    Inner,
    /// One open fan: the vertex is on the rim. Its defect π − Σθ is the turn of the rim, no
    /// curvature of the surface.
    Rim,
    /// Several fans, an edge with more than two faces, or a face turned over: the curvature is
    /// undefined.
    Irregular,
    /// No face.
    #[default]
    Unused,
}

/// Curvature at one vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VertexCurvature {
    /// Arrangement of its faces.
    pub kind: VertexKind,
    /// Integral of the Gaussian curvature, rad: 2π − Σθ; on the rim π − Σθ (turn of the rim); 0 if
    /// irregular.
    pub defect: f64,
    /// Integral of the mean curvature, m; positive on bumps, negative in depressions; 0 on the rim
    /// and if irregular.
    pub integrated_mean: f64,
    /// Mixed Voronoi area, m².
    pub area: f64,
}

impl VertexCurvature {
    /// Gaussian curvature κ₁κ₂, 1/m²; 0 on the rim and for area 0.
    pub fn gaussian(&self) -> f64 {
        if self.kind == VertexKind::Inner && self.area > 0.0 {
            self.defect / self.area
        } else {
            0.0
        }
    }

    /// Mean curvature (κ₁ + κ₂)/2, 1/m; positive on bumps; 0 on the rim and for area 0.
    pub fn mean(&self) -> f64 {
        if self.kind == VertexKind::Inner && self.area > 0.0 {
            self.integrated_mean / self.area
        } else {
            0.0
        }
    }
}

/// Curvature at all vertices, indexed by [`VertexId`].
pub fn curvature(mesh: &TriMesh) -> Vec<VertexCurvature> {
    let mut fan = Fan::default();
    (0..mesh.vertex_slots() as u32)
        .map(|vertex| fan.curvature(mesh, VertexId(vertex)))
        .collect()
}

/// The faces around a vertex, as pairs of its neighbours; kept only for its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Fan {
    links: Vec<[u32; 2]>,
    /// the next face after each one
    next: Vec<u32>,
}

/// Maximum size of fans for a linear search; larger ones use bisection.
const SMALL_FAN: usize = 8;
/// More than the sum of all places in one.
const COUNTED: u32 = 64;

impl Fan {
    /// Curvature at one vertex: an edit changes the vertices of the moved faces.
    #[inline]
    pub(crate) fn curvature(&mut self, mesh: &TriMesh, vertex: VertexId) -> VertexCurvature {
        self.gather(mesh, vertex);
        let kind = self.kind();
        if kind == VertexKind::Unused {
            return VertexCurvature::default();
        }
        let sums = CornerSums::around(mesh, &mesh.position(vertex), &self.links);
        let (defect, integrated_mean) = match kind {
            VertexKind::Inner => (
                sums.angle_short_of_full_turn(),
                0.5 * sums.gradient_along_normal(),
            ),
            VertexKind::Rim => (sums.angle_short_of_full_turn() - PI, 0.0),
            _ => (0.0, 0.0),
        };
        VertexCurvature {
            kind,
            defect,
            integrated_mean,
            area: sums.area,
        }
    }

    /// The next two neighbours in each face.
    #[inline]
    fn gather(&mut self, mesh: &TriMesh, vertex: VertexId) {
        self.links.clear();
        self.links.extend(mesh.star(vertex).iter().map(|&face| {
            let [next, last] = mesh.other_corners(face, vertex);
            [next.0, last.0]
        }));
    }

    #[inline]
    fn kind(&mut self) -> VertexKind {
        let count = self.links.len();
        if count == 0 {
            return VertexKind::Unused;
        }
        if count > SMALL_FAN {
            self.links.sort_unstable();
        }
        if !self.link_up() {
            return self.kind_of_open();
        }
        // one round must pass all faces, and is back at the first no later; with two faces of the
        // same end it never is
        let (mut at, mut steps) = (self.next[0], 1);
        while at != 0 && steps < count {
            (at, steps) = (self.next[at as usize], steps + 1);
        }
        if at == 0 && steps == count {
            VertexKind::Inner
        } else {
            VertexKind::Irregular
        }
    }

    /// Fills `next`; returns whether each face has exactly one.
    #[inline]
    fn link_up(&mut self) -> bool {
        self.next.clear();
        if self.links.len() > SMALL_FAN {
            return self.link_up_large();
        }
        // always all places, so that the loop is a few wide instructions; no vertex has the number
        // u32::MAX
        let mut starts = [u32::MAX; SMALL_FAN];
        for (start, link) in starts.iter_mut().zip(&self.links) {
            *start = link[0];
        }
        let mut sound = true;
        self.next.extend(self.links.iter().map(|&[_, end]| {
            // number of matches, and the sum of their places, in one number
            let found =
                |(i, &start): (usize, &u32)| if start == end { COUNTED + i as u32 } else { 0 };
            let places: u32 = starts.iter().enumerate().map(found).sum();
            sound &= places / COUNTED == 1;
            places % COUNTED
        }));
        sound
    }

    #[cold]
    fn link_up_large(&mut self) -> bool {
        let first = |end: u32| self.links.partition_point(|link| link[0] < end);
        self.next
            .extend(self.links.iter().map(|link| first(link[1]) as u32));
        let count = |(link, &at): (&[u32; 2], &u32)| {
            self.links[at as usize..]
                .iter()
                .take(2)
                .filter(|other| other[0] == link[1])
                .count()
        };
        self.links
            .iter()
            .zip(&self.next)
            .all(|pair| count(pair) == 1)
    }

    /// On the rim one face begins without a predecessor; from there the walk must pass all.
    #[cold]
    fn kind_of_open(&self) -> VertexKind {
        let (mut starts, mut ends) = (self.links.clone(), self.links.clone());
        starts.sort_unstable_by_key(|link| link[0]);
        ends.sort_unstable_by_key(|link| link[1]);
        let is_twice = |pair: &[[u32; 2]], side: usize| pair[0][side] == pair[1][side];
        if starts.windows(2).any(|pair| is_twice(pair, 0))
            || ends.windows(2).any(|pair| is_twice(pair, 1))
        {
            return VertexKind::Irregular;
        }
        let mut firsts = starts
            .iter()
            .filter(|link| ends.binary_search_by_key(&link[0], |end| end[1]).is_err());
        let (Some(first), None) = (firsts.next(), firsts.next()) else {
            return VertexKind::Irregular;
        };
        let after = |link: &[u32; 2]| {
            starts
                .binary_search_by_key(&link[1], |start| start[0])
                .ok()
                .map(|i| starts[i])
        };
        let steps = std::iter::successors(Some(*first), after).count();
        if steps == self.links.len() {
            VertexKind::Rim
        } else {
            VertexKind::Irregular
        }
    }
}

/// Sums over the corners at one vertex.
struct CornerSums {
    /// sum of angles: argument of the product of complex numbers
    re: f64,
    im: f64,
    /// full turns of that product
    turns: u32,
    /// 1/m²: makes these numbers of order one
    scale: f64,
    area: f64,
    double_area_normal: Vector3<f64>,
    area_gradient: Vector3<f64>,
}

/// Products outside this range are scaled back to 1, long before they overflow.
const MAGNITUDES: std::ops::Range<f64> = 1e-100..1e100;
/// Up to this tangent the series of the arc tangent to the 17th power is exact: the next term is
/// below 2⁻⁶¹ of the angle.
const SMALL_TANGENT: f64 = 0.125;

impl CornerSums {
    #[inline]
    fn around(mesh: &TriMesh, vertex: &Point3<f64>, links: &[[u32; 2]]) -> Self {
        let positions = mesh.positions();
        let zero = Vector3::zeros();
        let first = (positions[links[0][0] as usize] - vertex).norm_squared();
        let scale = if first > f64::MIN_POSITIVE {
            first.recip()
        } else {
            1.0
        };
        let mut sums = Self {
            re: 1.0,
            im: 0.0,
            turns: 0,
            scale,
            area: 0.0,
            double_area_normal: zero,
            area_gradient: zero,
        };
        let corner = |&[p, q]: &[u32; 2]| {
            [
                positions[p as usize] - vertex,
                positions[q as usize] - vertex,
            ]
        };
        let (pairs, last) = links.as_chunks::<2>();
        for pair in pairs {
            let corners = Corners::between([corner(&pair[0]), corner(&pair[1])]);
            sums.add(&corners, 0);
            sums.add(&corners, 1);
        }
        for link in last {
            sums.add(&Corners::between([corner(link); 2]), 0);
        }
        sums
    }

    #[inline]
    fn add(&mut self, corners: &Corners, i: usize) {
        let vector = |v: &[F64x2; 3]| Vector3::new(v[0][i], v[1][i], v[2][i]);
        self.turn(corners.cos[i] * self.scale, corners.sin[i] * self.scale);
        self.area += corners.area[i];
        self.double_area_normal += vector(&corners.normal);
        self.area_gradient -= vector(&corners.gradient);
    }

    /// Turns the product by an angle of 0 to π of any length. A full turn counts at the negative
    /// half of the real axis. Each corner adds a rounding or two to the angle, without an arc
    /// tangent.
    #[inline]
    fn turn(&mut self, cos: f64, sin: f64) {
        let (re, im) = (self.re * cos - self.im * sin, self.re * sin + self.im * cos);
        let magnitude = re.abs() + im.abs();
        if MAGNITUDES.contains(&magnitude) {
            self.turns += u32::from(self.im >= 0.0 && im < 0.0);
            (self.re, self.im) = (re, im);
        } else {
            self.turn_extreme(cos, sin);
        }
    }

    /// As `turn`, with both scaled to length 1 first; an angle of no length is none.
    #[cold]
    fn turn_extreme(&mut self, cos: f64, sin: f64) {
        let (length, own) = (cos.hypot(sin), self.re.hypot(self.im));
        if length > 0.0 && length.is_finite() {
            (self.re, self.im) = (self.re / own, self.im / own);
            self.turn(cos / length, sin / length);
        }
    }

    /// 2π less the sum of the angles, rad.
    #[inline]
    fn angle_short_of_full_turn(&self) -> f64 {
        TAU * (1.0 - f64::from(self.turns)) - argument(self.re, self.im)
    }

    #[inline]
    fn gradient_along_normal(&self) -> f64 {
        let length = self.double_area_normal.norm();
        if length > 0.0 {
            self.area_gradient.dot(&self.double_area_normal) / length
        } else {
            0.0
        }
    }
}

/// Argument of a complex number, rad, with a short cut for the many vertices that are nearly flat.
#[inline]
fn argument(re: f64, im: f64) -> f64 {
    if im.abs() > SMALL_TANGENT * re {
        // −0.0 would be on the other side of the cut
        return (im + 0.0).atan2(re);
    }
    let t = im / re;
    let tt = t * t;
    let series = [17.0, -15.0, 13.0, -11.0, 9.0, -7.0, 5.0, -3.0]
        .iter()
        .fold(0.0, |sum, n| sum * tt + 1.0 / n);
    t + t * tt * series
}

/// Two numbers, for operations on both at once.
type F64x2 = [f64; 2];

#[inline]
fn two(of: impl Fn(usize) -> f64) -> F64x2 {
    [of(0), of(1)]
}

/// Quantities at one corner of each of two faces: one wide instruction does the same sum for both.
struct Corners {
    cos: F64x2,
    sin: F64x2,
    area: F64x2,
    normal: [F64x2; 3],
    gradient: [F64x2; 3],
}

impl Corners {
    /// Each between two edges, counter-clockwise.
    #[inline]
    fn between(edges: [[Vector3<f64>; 2]; 2]) -> Self {
        let e = [0, 1, 2].map(|axis| two(|i| edges[i][0][axis]));
        let f = [0, 1, 2].map(|axis| two(|i| edges[i][1][axis]));
        let dot = |a: &[F64x2; 3], b: &[F64x2; 3]| {
            two(|i| a[0][i] * b[0][i] + a[1][i] * b[1][i] + a[2][i] * b[2][i])
        };
        let normal =
            [(1, 2), (2, 0), (0, 1)].map(|(j, k)| two(|i| e[j][i] * f[k][i] - e[k][i] * f[j][i]));
        let (cos, square) = (dot(&e, &f), dot(&normal, &normal));
        let sin = two(|i| square[i].sqrt());
        // a corner without area adds nothing
        let per_sin = two(|i| if sin[i] > 0.0 { 1.0 / sin[i] } else { 0.0 });
        let (ee, ff) = (dot(&e, &e), dot(&f, &f));
        // e·(e − f) and f·(f − e): the cosines at the two other corners; over sin, their cotangents
        let (at_e, at_f) = (two(|i| ee[i] - cos[i]), two(|i| ff[i] - cos[i]));
        let nearest = two(|i| (ee[i] * at_f[i] + ff[i] * at_e[i]) * per_sin[i] / 8.0);
        let area = two(|i| mixed_area(nearest[i], sin[i], [cos[i], at_e[i], at_f[i]]));
        let gradient = [0, 1, 2].map(|axis| {
            two(|i| (f[axis][i] * at_e[i] + e[axis][i] * at_f[i]) * (0.5 * per_sin[i]))
        });
        Self {
            cos,
            sin,
            area,
            normal,
            gradient,
        }
    }
}

/// Share of a corner in its triangle: the part nearest to it, or of an obtuse triangle half (the
/// obtuse corner) or a quarter (the others) of all. `sin` is twice the area of the triangle, the
/// cosines those at the three corners.
#[inline]
fn mixed_area(nearest: f64, sin: f64, [cos, at_e, at_f]: [f64; 3]) -> f64 {
    let of_obtuse = if cos < 0.0 { sin / 4.0 } else { sin / 8.0 };
    if cos.min(at_e).min(at_f) < 0.0 {
        of_obtuse
    } else {
        nearest
    }
}
