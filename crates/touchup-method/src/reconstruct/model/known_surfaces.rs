//! All known surfaces of a part, and the field of those that count.

use nalgebra::{Point3, Vector3};

use super::extent::SurfaceExtent;
use super::known_surface::{KnownSurface, KnownSurfaceError};

/// Depth of a point in front of or behind a surface at which the surface decides, in radii of the
/// tip: behind it may be another wall, as for contacts.
const DEPTH: f64 = 0.8;
/// How far a surface goes on beyond its last place, in radii of the tip: over the cells at an edge,
/// on a lattice of half the radius, and no farther than the tip was beside its last contact.
const BEYOND: f64 = 1.0;
/// How far a surface is known of beyond its last place at all, in radii of the tip: as a contact.
const REACH: f64 = 2.0;
/// Distance of a point in the air of a hollow at which its walls decide, in radii of the tip: there
/// the scan may close it over, and farther in it may have a thing of its own.
const HOLLOW: f64 = 2.0;
/// Largest distance of a contact from its surface, in radii of the tip: as the noise of touches
/// that a fit keeps.
const OFF: f64 = 0.1;
/// Most cells of all known surfaces, as wide as the tip's radius: 0.2 m² for a ball of 1.5 mm.
const MOST_CELLS: f64 = 1e5;

/// How two surfaces meet, as the nearest contacts lie: each in the material of the other, each in
/// the air of the other, or neither.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SurfaceMeeting {
    Convex,
    Concave,
    Apart,
}

/// A surface with what follows from it.
#[derive(Clone, Debug)]
struct KnownPart {
    known: KnownSurface,
    extent: SurfaceExtent,
    /// ball around the extent, m
    middle: Point3<f64>,
    reach: f64,
    /// whether all of its contacts are among the touches
    counts: bool,
}

impl KnownPart {
    /// Distance of a place on the surface beyond its extent, m.
    fn beyond(&self, foot: &Point3<f64>) -> f64 {
        let local = self.known.surface.placement.local(foot);
        self.extent.beyond(&local)
    }
}

/// The known surfaces of a part.
#[derive(Clone, Debug)]
pub struct KnownSurfaces {
    /// size of the tip, m
    radius: f64,
    parts: Vec<KnownPart>,
    /// numbers of those that count
    counting: Vec<usize>,
    /// how each of these meets each
    meetings: Vec<SurfaceMeeting>,
    cells: f64,
}

/// The field of the known surfaces at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::reconstruct) struct KnownValue {
    /// signed distance, m, positive outside the part
    pub value: f64,
    /// unit gradient
    pub gradient: Vector3<f64>,
    /// standard deviation of the surface that decides, m
    pub sigma: f64,
    /// distance beyond the last place of the surface, away from its edges, m
    pub beyond: f64,
}

/// A surface near a point.
#[derive(Clone, Copy)]
struct NearSurface {
    /// its number among those that count
    at: usize,
    value: f64,
    gradient: Vector3<f64>,
    /// distance of the foot from the part of it between its places, m
    beyond: f64,
}

impl KnownSurfaces {
    /// None yet.
    ///
    /// - `radius`: size of the tip, m.
    pub fn new(radius: f64) -> Self {
        Self {
            radius,
            parts: Vec::new(),
            counting: Vec::new(),
            meetings: Vec::new(),
            cells: 0.0,
        }
    }

    /// Adds a surface, unless it is known.
    ///
    /// # Errors
    /// [`KnownSurfaceError`]
    pub fn add(&mut self, known: KnownSurface) -> Result<(), KnownSurfaceError> {
        known.check(OFF * self.radius)?;
        if self.parts.iter().any(|part| part.known == known) {
            return Ok(());
        }
        let extent = known.extent();
        let cells = self.cells + extent.count(self.radius);
        if cells.is_nan() || cells > MOST_CELLS {
            return Err(KnownSurfaceError::Wide { most: MOST_CELLS });
        }
        self.cells = cells;
        let places = extent.places(&known.surface, self.radius);
        let middle = Point3::from(
            places
                .iter()
                .map(|place| place.coords)
                .sum::<Vector3<f64>>()
                / places.len() as f64,
        );
        let farthest = places.iter().map(|place| (place - middle).norm());
        self.parts.push(KnownPart {
            reach: farthest.fold(0.0, f64::max) + self.radius * (1.0 + REACH),
            known,
            extent,
            middle,
            counts: false,
        });
        Ok(())
    }

    /// Adds the surfaces of another patcher of the part; as many as there is room for.
    pub(crate) fn add_all(&mut self, others: Self) {
        for part in others.parts {
            // it was valid there
            let _ = self.add(part.known);
        }
    }

    /// Decides which surfaces count; returns places that cover those that now do or no longer do, m.
    ///
    /// - `is_touched`: whether there is a contact at a place, m in O, with about this outward unit
    ///   normal; `None`: with any.
    pub(crate) fn update(
        &mut self,
        is_touched: impl Fn(&Point3<f64>, Option<&Vector3<f64>>) -> bool,
    ) -> Vec<Point3<f64>> {
        let mut changed = Vec::new();
        for part in &mut self.parts {
            let is_there =
                |place: &Point3<f64>| is_touched(place, Some(&part.known.value(place).1));
            let is_any = |place: &Point3<f64>| is_touched(place, None);
            let known = &part.known;
            let counts = known.contacts.iter().all(is_there) && known.others.iter().all(is_any);
            if counts != std::mem::replace(&mut part.counts, counts) {
                changed.extend(part.extent.places(&part.known.surface, self.radius));
            }
        }
        if !changed.is_empty() {
            let counts = |at: &usize| self.parts[*at].counts;
            self.counting = (0..self.parts.len()).filter(counts).collect();
            self.meetings = self.meetings();
        }
        changed
    }

    /// Places that cover the surfaces that count, m.
    pub(crate) fn places(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        self.counting().flat_map(|part| self.places_of(part))
    }

    /// Places that cover all surfaces, m.
    pub(crate) fn all_places(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        self.parts.iter().flat_map(|part| self.places_of(part))
    }

    fn places_of(&self, part: &KnownPart) -> Vec<Point3<f64>> {
        part.extent.places(&part.known.surface, self.radius)
    }

    fn counting(&self) -> impl Iterator<Item = &KnownPart> {
        self.counting.iter().map(|&at| &self.parts[at])
    }

    fn meetings(&self) -> Vec<SurfaceMeeting> {
        // nearer to the other surface a contact is on their edge
        let clear = OFF * self.radius;
        // farther ones may be on the other side of a wall across
        let side = |of: &KnownPart, other: &KnownPart| {
            let from_other = of.known.contacts.iter().map(|contact| {
                let (value, gradient) = other.known.value(contact);
                (value, other.beyond(&(contact - gradient * value)))
            });
            let nearest = from_other
                .filter(|(value, _)| value.abs() > clear)
                .min_by(|a, b| a.0.hypot(a.1).total_cmp(&b.0.hypot(b.1)));
            nearest.map(|(value, _)| value)
        };
        let meeting = |a: &KnownPart, b: &KnownPart| match (side(a, b), side(b, a)) {
            (Some(a), Some(b)) if a < 0.0 && b < 0.0 => SurfaceMeeting::Convex,
            (Some(a), Some(b)) if a > 0.0 && b > 0.0 => SurfaceMeeting::Concave,
            _ => SurfaceMeeting::Apart,
        };
        let all = || self.counting();
        all()
            .flat_map(|a| all().map(move |b| meeting(a, b)))
            .collect()
    }

    fn meeting(&self, a: usize, b: usize) -> SurfaceMeeting {
        self.meetings[a * self.counting.len() + b]
    }

    /// The field at `x` (m, in O); `None` where no known surface decides.
    pub(in crate::reconstruct) fn at(&self, x: &Point3<f64>) -> Option<KnownValue> {
        let near = (0..).zip(self.counting());
        let mut near: Vec<_> = near
            .filter_map(|(at, part)| self.near(at, part, x))
            .collect();
        let distance = |one: &NearSurface| one.value.hypot(one.beyond);
        near.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let mut set: Vec<NearSurface> = Vec::new();
        for one in &near {
            let is_beside =
                |other: &NearSurface| self.meeting(one.at, other.at) == SurfaceMeeting::Apart;
            // the nearer of two that do not meet hides the other
            if one.beyond <= BEYOND * self.radius && !set.iter().any(is_beside) {
                set.push(*one);
            }
        }
        let found = if set.is_empty() {
            *near.first()?
        } else {
            self.evaluated(&set)
        };
        let is_near = |one: &NearSurface| one.value.abs() <= DEPTH * self.radius;
        let is_in_hollow =
            || (0.0..=HOLLOW * self.radius).contains(&found.value) && self.is_hollow(&found, &set);
        if !is_near(&found) && !set.iter().any(is_near) && !is_in_hollow() {
            return None;
        }
        let is_edge = set.iter().filter(|one| is_near(one)).count() > 1;
        Some(KnownValue {
            value: found.value,
            gradient: found.gradient,
            sigma: self.parts[self.counting[found.at]].known.sigma,
            beyond: if is_edge { 0.0 } else { found.beyond },
        })
    }

    /// The surface that decides among surfaces that all meet: the part is what is common to those
    /// that meet in convex edges, and all of those that meet in concave ones.
    ///
    /// - `set`: at least one, the nearest first.
    fn evaluated(&self, set: &[NearSurface]) -> NearSurface {
        for (joint, side) in [
            (SurfaceMeeting::Convex, 1.0),
            (SurfaceMeeting::Concave, -1.0),
        ] {
            let groups = self.groups(set, joint);
            if groups.len() > 1 {
                let values = groups.iter().map(|group| self.evaluated(group));
                let least = |a: &NearSurface, b: &NearSurface| {
                    (side * a.value).total_cmp(&(side * b.value))
                };
                return values.min_by(least).unwrap_or(set[0]);
            }
        }
        set[0]
    }

    /// The parts of a set that are connected by such meetings.
    fn groups(&self, set: &[NearSurface], joint: SurfaceMeeting) -> Vec<Vec<NearSurface>> {
        let mut groups: Vec<Vec<NearSurface>> = Vec::new();
        for one in set {
            let is_joined = |group: &Vec<NearSurface>| {
                let mut all = group.iter();
                all.any(|other| self.meeting(one.at, other.at) == joint)
            };
            let (joined, apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(is_joined);
            groups = apart;
            let mut group: Vec<_> = joined.into_iter().flatten().collect();
            group.push(*one);
            group.sort_by(|a, b| a.value.hypot(a.beyond).total_cmp(&b.value.hypot(b.beyond)));
            groups.push(group);
        }
        groups
    }

    /// Whether a surface has others, or itself, across its air.
    fn is_hollow(&self, one: &NearSurface, set: &[NearSurface]) -> bool {
        let known = &self.parts[self.counting[one.at]].known;
        let is_across =
            |other: &NearSurface| self.meeting(one.at, other.at) == SurfaceMeeting::Concave;
        one.beyond == 0.0 && (known.is_concave || set.iter().any(is_across))
    }

    /// Whether a surface that faces alike is within `reach` (m) of a place.
    ///
    /// - `facing`: unit normal there.
    pub(in crate::reconstruct) fn is_beside(
        &self,
        place: &Point3<f64>,
        facing: &Vector3<f64>,
        reach: f64,
        least_cosine: f64,
    ) -> bool {
        (0..).zip(self.counting()).any(|(at, part)| {
            self.near(at, part, place).is_some_and(|near| {
                near.value.hypot(near.beyond) <= reach && near.gradient.dot(facing) > least_cosine
            })
        })
    }

    /// A surface at `x`, if its foot there is between its places or little beyond.
    fn near(&self, at: usize, part: &KnownPart, x: &Point3<f64>) -> Option<NearSurface> {
        let (value, gradient) = part.known.value(x);
        let foot = x - gradient * value;
        if (foot - part.middle).norm_squared() > part.reach * part.reach {
            return None;
        }
        let beyond = part.beyond(&foot);
        (beyond <= REACH * self.radius).then_some(NearSurface {
            at,
            value,
            gradient,
            beyond,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touchup_geometry::brep::{AnalyticSurface, SurfaceShape};

    const RADIUS: f64 = 1.5e-3;

    fn p(x: f64, y: f64, z: f64) -> Point3<f64> {
        Point3::new(x, y, z) * 1e-3
    }

    fn known(
        surface: AnalyticSurface,
        is_concave: bool,
        contacts: Vec<Point3<f64>>,
        ends: Vec<Point3<f64>>,
    ) -> KnownSurface {
        KnownSurface {
            surface,
            is_concave,
            sigma: 5e-6,
            contacts,
            others: Vec::new(),
            ends,
        }
    }

    fn plane(at: Point3<f64>, normal: Vector3<f64>, places: [Vec<Point3<f64>>; 2]) -> KnownSurface {
        let [contacts, ends] = places;
        let surface = AnalyticSurface::along(at, normal, SurfaceShape::Plane);
        known(surface, false, contacts, ends)
    }

    /// A ring of places about z.
    fn ring(radius: f64, z: f64, count: usize) -> Vec<Point3<f64>> {
        let angle = |at: usize| std::f64::consts::TAU * at as f64 / count as f64;
        (0..count)
            .map(|at| p(radius * angle(at).cos(), radius * angle(at).sin(), z))
            .collect()
    }

    /// The face z = 0 around a blind hole of 8 mm, 6 mm deep.
    fn blind_hole() -> Vec<KnownSurface> {
        let axis = AnalyticSurface::along(
            Point3::origin(),
            Vector3::z(),
            SurfaceShape::Cylinder { radius: 4e-3 },
        );
        let [rim, foot] = [0.0, -6.0].map(|z| ring(4.0, z, 6));
        vec![
            plane(
                Point3::origin(),
                Vector3::z(),
                [ring(6.0, 0.0, 4), rim.clone()],
            ),
            known(axis, true, ring(4.0, -3.0, 6), [rim, foot.clone()].concat()),
            plane(
                p(0.0, 0.0, -6.0),
                Vector3::z(),
                [vec![p(0.0, 0.0, -6.0)], foot],
            ),
        ]
    }

    /// A slot of 6 mm between two walls along x, 5 mm deep.
    fn slot() -> Vec<KnownSurface> {
        let along = |y: f64, z: f64| [-7.0, 0.0, 7.0].map(|x| p(x, y, z)).to_vec();
        let wall = |side: f64| {
            let ends = [along(3.0 * side, 0.0), along(3.0 * side, -5.0)].concat();
            let contacts = along(3.0 * side, -2.0);
            plane(
                p(0.0, 3.0 * side, 0.0),
                Vector3::y() * -side,
                [contacts, ends],
            )
        };
        let top = [along(5.0, 0.0), along(-5.0, 0.0)].concat();
        let foot = [along(3.0, -5.0), along(-3.0, -5.0)].concat();
        vec![
            plane(Point3::origin(), Vector3::z(), [top, Vec::new()]),
            wall(1.0),
            wall(-1.0),
            plane(
                p(0.0, 0.0, -5.0),
                Vector3::z(),
                [vec![p(0.0, 0.0, -5.0)], foot],
            ),
        ]
    }

    fn all(surfaces: Vec<KnownSurface>) -> KnownSurfaces {
        let mut all = KnownSurfaces::new(RADIUS);
        surfaces
            .into_iter()
            .for_each(|known| all.add(known).unwrap());
        all.update(|_, _| true);
        all
    }

    /// Value, mm, and gradient; `None` where nothing is known.
    fn at(all: &KnownSurfaces, x: f64, y: f64, z: f64) -> Option<(f64, Vector3<f64>)> {
        let found = all.at(&p(x, y, z))?;
        Some((found.value * 1e3, found.gradient))
    }

    #[test]
    fn a_blind_hole_is_round_from_its_rim_to_its_floor() {
        let hole = all(blind_hole());
        let value = |rho: f64, z: f64| {
            // between the contacts
            let found = at(&hole, rho * 0.6, rho * 0.8, z);
            (found.unwrap().0 * 1e9).round() / 1e9
        };
        for z in [-0.2, -3.0, -5.5] {
            assert_eq!((value(3.9, z), value(4.1, z)), (0.1, -0.1), "{z}");
        }
        // face and wall meet in a convex edge, wall and floor in a concave one
        assert_eq!((value(4.2, -0.1), value(4.1, -0.2)), (-0.1, -0.1));
        assert_eq!((value(4.3, 0.2), value(3.8, 0.1)), (0.2, 0.2));
        assert_eq!((value(3.7, -5.9), value(3.9, -5.7)), (0.1, 0.1));
        assert_eq!((value(4.2, -5.9), value(3.9, -6.2)), (-0.2, -0.2));
        // the scan may close it over
        assert!(value(1.5, -0.3) > 1.0 && value(2.0, 0.1) > 1.0);
    }

    #[test]
    fn the_middle_of_a_slot_is_air() {
        let slot = all(slot());
        for z in [-0.1, -0.6, -1.1, -2.5, -4.0] {
            let (value, _) = at(&slot, 3.0, 0.2, z).unwrap();
            assert!(value > 0.9, "{z}: {value}");
        }
        let (value, normal) = at(&slot, 3.0, 2.9, -2.5).unwrap();
        assert!((value - 0.1).abs() < 1e-9 && normal == -Vector3::y());
    }

    /// The walls are planes without end: beyond each of them lies the air of the other.
    #[test]
    fn the_face_around_a_slot_is_whole() {
        let slot = all(slot());
        for y in [3.2, -3.2, 4.8, -4.8] {
            for z in [0.1, -0.1] {
                let (value, normal) = at(&slot, 1.0, y, z).unwrap();
                assert!(
                    (value - z).abs() < 1e-9 && normal == Vector3::z(),
                    "{y} {z}: {value}"
                );
            }
        }
    }

    #[test]
    fn a_surface_ends_a_little_beyond_its_places() {
        let face = all(vec![plane(
            Point3::origin(),
            Vector3::z(),
            [ring(6.0, 0.0, 4), Vec::new()],
        )]);
        let beyond = |x: f64| face.at(&p(x, 0.0, 0.3)).map(|found| found.beyond * 1e3);
        assert_eq!(beyond(2.0), Some(0.0));
        assert!((beyond(7.0).unwrap() - 1.0).abs() < 1e-9);
        assert_eq!((beyond(9.1), at(&face, 0.0, 0.0, 1.3)), (None, None));
        assert!(
            at(&face, 0.0, 0.0, -1.3).is_none(),
            "another wall may be there"
        );
    }

    #[test]
    fn a_surface_counts_as_long_as_each_of_its_contacts_is_there() {
        let mut hole = KnownSurfaces::new(RADIUS);
        for known in blind_hole() {
            hole.add(known.clone()).unwrap();
            hole.add(known).unwrap();
        }
        assert_eq!(hole.parts.len(), 3, "the same twice is one");
        let gone = blind_hole()[1].contacts[2];
        let near = |a: &Point3<f64>, b: &Point3<f64>| (a - b).norm() < 1e-6;
        assert!(!hole.update(|_, _| true).is_empty());
        assert!(hole.update(|_, _| true).is_empty(), "nothing has changed");
        let wall = |hole: &KnownSurfaces| at(hole, 3.9, 0.0, -3.0).is_some();
        assert!(wall(&hole));
        let changed = hole.update(|place, _| !near(place, &gone));
        assert!(!wall(&hole));
        assert!(
            changed
                .iter()
                .all(|place| (place.xy().coords.norm() - 4e-3).abs() < 1e-9)
        );
        assert!(!hole.update(|_, _| true).is_empty() && wall(&hole));
    }

    #[test]
    fn what_is_no_surface_is_refused() {
        let good = || blind_hole().remove(1);
        let refused = |change: &dyn Fn(&mut KnownSurface)| {
            let mut bad = good();
            change(&mut bad);
            KnownSurfaces::new(RADIUS).add(bad).unwrap_err().to_string()
        };
        let is = |why: String, word: &str| assert!(why.contains(word), "{why}");
        is(refused(&|bad| bad.sigma = f64::NAN), "uncertainty");
        is(refused(&|bad| bad.contacts.clear()), "0 contacts");
        is(refused(&|bad| bad.contacts[0].x = f64::NAN), "off it");
        is(refused(&|bad| bad.ends[0].x += 1e-3), "off it");
        is(
            refused(&|bad| bad.surface.placement.axis *= 2.0),
            "unit vector",
        );
        let shape = SurfaceShape::Cylinder { radius: -4e-3 };
        is(refused(&|bad| bad.surface.shape = shape), "positive");
        is(refused(&|bad| bad.ends[0].z = 1e3), "covers more");
        is(refused(&|bad| bad.ends[0].z = 1e9), "off it");
    }
}
