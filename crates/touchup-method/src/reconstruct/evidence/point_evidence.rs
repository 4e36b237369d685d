//! Evidence of touches, free space and the scan at one point.

use nalgebra::Point3;

use crate::reconstruct::evidence::agreement::{Agreement, BENT, ContactsAround, TouchedPart};
use crate::reconstruct::evidence::contact_map::ContactMap;
use crate::reconstruct::evidence::contact_uncertainty::UncertaintyParams;
use crate::reconstruct::evidence::free_space::FreeSpace;
use crate::reconstruct::evidence::inner_corner::is_inner_corner;
use crate::reconstruct::evidence::piecewise::{FieldOrigin, FieldParams, FieldScratch, FieldValue};
use crate::reconstruct::evidence::scan_distance::ScanDistance;
use crate::reconstruct::model::{KnownSurfaces, KnownValue};
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_geometry::numeric::direction;

/// Limit of the values, in cells: far from the surface only the sign matters.
const WIDEST: f64 = 2.7;
/// Straight continuation of the scan beyond an open rim, in cells: up to the corners of the cells
/// on the rim.
const RIM_REACH: f64 = 1.732;

/// Weights of the kinds of evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvidenceParams {
    /// radius of the ball, or size of another tip, m
    pub radius: f64,
    /// the fit of the contacts
    pub field: FieldParams,
    /// maximum distance at which the scan counts as evidence, m
    pub scan_reach: f64,
}

/// Depth of the ball in the surface from noise alone, in radii.
const SWEPT_MARGIN: f64 = 0.027;
/// Support of contacts all around a point, along the surface, in radii.
const INNER_SUPPORT: f64 = 1.3;
/// Support of the last contacts of a surface beyond them, in radii.
const BORDER_SUPPORT: f64 = 0.75;
/// Continuation of two touched surfaces towards their common edge, in radii.
const EDGE_SUPPORT: f64 = 1.0;
/// Continuation of the tilted plane at an edge that the ball rolled over, in radii.
const FAN_SUPPORT: f64 = 0.25;
/// Maximum distance from its surface at which a contact counts, in radii: behind it may be another
/// wall.
const TOUCH_DEPTH: f64 = 0.8;
/// Distance of a contact from the known surfaces beyond which they do not explain it, in radii, and
/// [`ENDS_SIGMAS`] of its standard deviations: 0.15 mm for a ball of 1.5 mm.
const UNEXPLAINED: f64 = 0.1;
/// Minimum distance of a free ball's centre from any contact, in radii.
pub(in crate::reconstruct) const FREE_REACH: f64 = 1.5;
/// Distance from a contact that faces alike within which the scan is rejected, in radii.
pub(in crate::reconstruct) const SCAN_REMOVAL: f64 = 1.3;
/// Divisor of the radius: the scan is rejected within that distance of any contact.
const WALL_REMOVAL: f64 = 3.0;
/// Cosine of the maximum angle between normals that face alike.
const ALIKE: f64 = 0.6;
/// The ball's centre within its radius plus this distance, in radii, sweeps the scan away.
pub(in crate::reconstruct) const SWEPT_REACH: f64 = 0.067;

impl EvidenceParams {
    /// Settings for a ball of `radius` (m) and a scan with points off by `noise` (m).
    pub(crate) fn new(radius: f64, noise: f64) -> Self {
        Self {
            radius,
            field: FieldParams::for_ball(radius),
            scan_reach: (3.0 * noise).max(radius / 2.0),
        }
    }
}

/// The evidence for a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// the scan, without contradiction
    Scan,
    /// touches
    Touch,
    /// the scan, beside touches of another surface
    Both,
    /// nothing nearby; filled
    Nothing,
    /// nothing, deep inside or far outside the scan; filled with a pull towards the scan
    Far,
    /// nothing, just beyond an open rim of the scan: it goes straight on
    Rim,
    /// nothing, beyond an open rim of the scan: the surface ends here
    Beyond,
}

/// The field at one node.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct NodeState {
    /// f, m
    pub value: f64,
    /// the evidence for it
    pub source: Source,
    /// the scan's own value, m
    pub scan: f64,
    /// without evidence: value of a touched surface going straight on, m, and its weight, 0 to 1
    pub straight: (f64, f64),
    /// lower bound of f from the presence of the ball here, m
    pub least: f64,
    /// a free path of the ball ended here, deep inside the scan, without a contact
    pub is_free_end: bool,
    /// out of reach of all evidence, evaluated for the continuation of a filled surface
    pub is_further: bool,
    /// value of the field of the touches, m; `None` out of their support
    pub touched_value: Option<f64>,
    /// whether touched surfaces extend here without a touch near: into an inner corner, or as a
    /// known surface
    pub is_extended: bool,
    /// number of the renewal of this value
    pub renewal: u32,
}

impl NodeState {
    /// Touched, with this value of the field, m.
    #[cfg(test)]
    pub(crate) fn touched(value: f64) -> Self {
        Self {
            value,
            source: Source::Touch,
            scan: 0.0,
            straight: (0.0, 0.0),
            least: f64::NEG_INFINITY,
            is_free_end: false,
            is_further: false,
            touched_value: Some(value),
            is_extended: false,
            renewal: 0,
        }
    }

    /// Whether nothing is known here, so the value needs a fill.
    pub(crate) fn is_open_question(&self) -> bool {
        matches!(self.source, Source::Nothing | Source::Far | Source::Rim)
    }

    /// Whether the skin differs from the scan here.
    pub(crate) fn is_changed(&self) -> bool {
        match self.source {
            Source::Touch | Source::Both | Source::Nothing => true,
            Source::Far | Source::Rim => self.is_turned(),
            Source::Scan | Source::Beyond => false,
        }
    }

    /// Whether the node is on the other side of the skin than of the scan.
    pub(crate) fn is_turned(&self) -> bool {
        (self.value < 0.0) != (self.scan < 0.0)
    }

    /// Whether the surface differs from `other` by more than `slack` (m).
    pub(crate) fn differs(&self, other: &Self, slack: f64) -> bool {
        self.source != other.source
            || (self.value < 0.0) != (other.value < 0.0)
            || (self.value - other.value).abs() > slack
    }
}

/// Share of the uncertainty of a touch below which its displacement by the scan, at most gate × σₜ²
/// / σₛ, is negligible and the scan stays unused.
const NOTICED: f64 = 0.1;

/// Distance from its last contact beyond which free space ends a touched surface, in radii.
const ENDS_FROM: f64 = 0.25;
/// Minimum depth of the ball in a touched surface that ends there: in radii, and in standard
/// deviations of the contact.
const ENDS_MARGIN: f64 = 0.05;
const ENDS_SIGMAS: f64 = 2.0;

/// Distances behind the scan of the test for further scan, in multiples of that of the point.
const AWAY: [f64; 3] = [2.0, 6.0, 18.0];
/// Minimum distance of the scan from the test points of [`AWAY`], as a share of the distance of its
/// foot, for no further scan.
const ALONE: f64 = 0.7;

/// All evidence.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence<'a> {
    /// weights
    pub params: &'a EvidenceParams,
    /// the contacts
    pub contacts: &'a ContactMap,
    /// the swept volume of the ball
    pub free_space: &'a FreeSpace,
    /// the known surfaces
    pub known: &'a KnownSurfaces,
    /// the original scan
    pub scan: &'a TriMesh,
    /// tree over the faces of the scan
    pub tree: &'a FaceTree,
    /// prior uncertainty of the scan; `None`: touches fully replace the scan
    pub prior: Option<UncertaintyParams>,
    /// the contacts that the scan agrees with: around them the scan, moved to them, is the surface
    pub agreement: Option<&'a Agreement>,
    /// whether the scan has no rim, so that its back is known: then the patch has no rim either
    pub is_closed: bool,
}

impl Evidence<'_> {
    /// The field at `x` (m, in O), a node of a lattice of `pitch` (m), with the distance of the
    /// scan in `scan`.
    pub(in crate::reconstruct) fn beside(
        &self,
        scan: &ScanDistance,
        x: &Point3<f64>,
        pitch: f64,
        scratch: &mut FieldScratch,
    ) -> NodeState {
        let touched = self.touched(x, Some(scan), scratch);
        let (mut value, mut source) = match &touched {
            Some(touched) => self.beside_touches(touched, scan),
            None => (scan.value, self.away_from_touches(scan)),
        };
        let (swept_depth, is_free_end) = self.swept_depth(x);
        if swept_depth > 0.0 && source != Source::Touch {
            (value, source) = (scan.value, Source::Nothing);
        }
        if source != Source::Far && self.is_detail(touched.as_ref(), scan, swept_depth) {
            (value, source) = (scan.value, Source::Scan);
        }
        let is_corner = matches!(source, Source::Nothing | Source::Both)
            && touched.is_some_and(|touched| {
                swept_depth <= touched.value.max(0.0) && self.is_corner(&touched, scratch)
            });
        if let Some(touched) = touched.filter(|_| is_corner) {
            (value, source) = (touched.value, Source::Touch);
        }
        let is_extended = is_corner
            || source == Source::Touch && touched.is_some_and(|touched| self.is_afar(&touched));
        let mut straight = touched.and_then(|touched| self.straight_on(&touched, scan));
        if scan.is_on_rim && !matches!(source, Source::Touch | Source::Both) {
            let is_just_beyond = scan.value.abs() < RIM_REACH * pitch;
            source = match swept_depth > 0.0 {
                _ if is_just_beyond => Source::Rim,
                true => Source::Nothing,
                false => Source::Beyond,
            };
            if is_just_beyond {
                straight = Some(((x - scan.foot).dot(&scan.normal), 1.0));
            }
        }
        // only the side of the scan counts here, which means nothing behind the part
        if source == Source::Far && swept_depth <= 0.0 && self.is_behind_part(scan, x, scratch) {
            source = Source::Beyond;
        }
        let widest = WIDEST * pitch;
        let is_swept = source != Source::Touch && swept_depth > 0.0;
        let least = if is_swept {
            swept_depth.min(widest)
        } else {
            f64::NEG_INFINITY
        };
        let value = value.clamp(-widest, widest).max(least);
        NodeState {
            value,
            source,
            scan: scan.value.clamp(-widest, widest),
            straight: straight.map_or((0.0, 0.0), |(value, share)| {
                (value.clamp(-widest, widest), share)
            }),
            least,
            is_free_end: least > 0.0 && is_free_end && scan.value < -self.params.scan_reach,
            is_further: false,
            touched_value: (source == Source::Touch).then_some(value),
            is_extended,
            renewal: 0,
        }
    }

    /// Distance of the scan at `x` (m, in O); `None` without a face.
    pub(crate) fn scan_at(&self, x: &Point3<f64>) -> Option<ScanDistance> {
        ScanDistance::at(self.scan, self.tree, x)
    }

    /// The field of the touches at `x` (m, in O): of a known surface, or of the contacts, which
    /// replace the scan by the gain σₛ² / (σₛ² + σₜ²) of the nearest one; `None` without either in
    /// reach.
    ///
    /// - `scan`: distance of the scan there, if known.
    pub(crate) fn touched(
        &self,
        x: &Point3<f64>,
        scan: Option<&ScanDistance>,
        scratch: &mut FieldScratch,
    ) -> Option<FieldValue> {
        let of_contacts = self.params.field.at(self.contacts, x, scratch);
        if let Some(KnownValue {
            value,
            gradient,
            sigma,
            beyond,
        }) = self.known_at(x, of_contacts.as_ref())
        {
            let from_contact = of_contacts.map_or(f64::INFINITY, |found| {
                (found.nearest * found.nearest - value * value)
                    .max(0.0)
                    .sqrt()
            });
            let mut found = FieldValue {
                value,
                gradient,
                nearest: value.hypot(beyond),
                origin: FieldOrigin::Known {
                    sigma,
                    from_contact,
                },
                is_fan: false,
                is_border: beyond > 0.0,
                is_edge: false,
            };
            self.end_at_free_space(&mut found, x);
            return Some(found);
        }
        let mut found = of_contacts?;
        if let Some(prior) = self.prior
            && found.value.abs() < prior.gate_sigmas * prior.scan
            && let of_touch = self.variance(&found)
            && prior.gate_sigmas * of_touch.sqrt() > NOTICED * prior.scan
            && let Some(scan) = scan.copied().or_else(|| self.scan_at(x))
        {
            let is_alike = !scan.is_on_rim && scan.normal.dot(&found.gradient) > ALIKE;
            let (off, of_both) = (scan.value - found.value, of_touch + prior.scan * prior.scan);
            if is_alike && off * off < prior.gate_sigmas * prior.gate_sigmas * of_both {
                found.value += off * of_touch / of_both;
            }
        }
        self.end_at_free_space(&mut found, x);
        Some(found)
    }

    /// The field of the known surfaces at `x` (m, in O); `None` also beside a contact that they do
    /// not explain.
    ///
    /// - `of_contacts`: the field of the contacts there.
    pub(in crate::reconstruct) fn known_at(
        &self,
        x: &Point3<f64>,
        of_contacts: Option<&FieldValue>,
    ) -> Option<KnownValue> {
        let known = self.known.at(x)?;
        let Some(found) = of_contacts else {
            return Some(known);
        };
        // the place of a contact on an edge depends on the direction of its force
        let is_beside = !found.is_fan && found.lateral() <= BORDER_SUPPORT * self.params.radius;
        let is_explained = |contact: u32| {
            let there = self
                .known
                .at(&self.contacts.means()[contact as usize].point);
            let most = UNEXPLAINED * self.params.radius
                + ENDS_SIGMAS * self.contacts.variance(contact).sqrt();
            there.is_some_and(|there| there.value.abs() <= most)
        };
        match found.origin {
            FieldOrigin::Contacts(contact) if is_beside && !is_explained(contact) => None,
            _ => Some(known),
        }
    }

    /// Variance of the surface along its normal, m².
    fn variance(&self, found: &FieldValue) -> f64 {
        match found.origin {
            FieldOrigin::Contacts(contact) => self.contacts.variance(contact),
            FieldOrigin::Known { sigma, .. } => sigma * sigma,
        }
    }

    /// Ends a touched surface beyond its last contact at the ball: it rolled around an edge there,
    /// or sank into a hole.
    pub(in crate::reconstruct) fn end_at_free_space(
        &self,
        found: &mut FieldValue,
        x: &Point3<f64>,
    ) {
        let radius = self.params.radius;
        // a tip of another shape reaches along its flank, and its nearest place says little of its
        // surface
        if found.off_contact() < ENDS_FROM * radius || !self.free_space.is_of_ball() {
            return;
        }
        let Some((distance, centre)) = self.free_space.nearest(x) else {
            return;
        };
        let margin = ENDS_MARGIN * radius + ENDS_SIGMAS * self.variance(found).sqrt();
        let depth = radius - margin - distance;
        if depth > found.value
            && let Some(outward) = direction(&(centre - x))
        {
            (found.value, found.gradient) = (depth, outward);
        }
    }

    /// The field of the touches if they support the point, else of the scan if it holds.
    fn beside_touches(&self, touched: &FieldValue, scan: &ScanDistance) -> (f64, Source) {
        let is_supported = self.is_supported(touched);
        let is_known = matches!(touched.origin, FieldOrigin::Known { .. }) && !touched.is_border;
        if is_known || is_supported && (!touched.is_border || touched.is_edge) {
            return (touched.value, Source::Touch);
        }
        let is_wall = scan.normal.dot(&touched.gradient) < ALIKE;
        let ends_at_wall = is_wall && scan.value > touched.value;
        if (ends_at_wall || !is_supported) && self.scan_holds(scan) {
            // a wall of the scan ends the touched surface
            return (
                if is_wall {
                    scan.value.max(touched.value)
                } else {
                    scan.value
                },
                Source::Both,
            );
        }
        if is_supported {
            (touched.value, Source::Touch)
        } else {
            (scan.value, Source::Nothing)
        }
    }

    /// Whether a known surface goes on here away from its contacts.
    fn is_afar(&self, touched: &FieldValue) -> bool {
        matches!(touched.origin, FieldOrigin::Known { .. })
            && touched.off_contact() > BORDER_SUPPORT * self.params.radius
    }

    /// Whether the contacts near a point support the touched surface there.
    fn is_supported(&self, touched: &FieldValue) -> bool {
        let support = match (touched.is_border, touched.is_fan) {
            _ if touched.is_edge => EDGE_SUPPORT,
            (false, _) => INNER_SUPPORT,
            (true, false) => BORDER_SUPPORT,
            (true, true) => FAN_SUPPORT,
        };
        let radius = self.params.radius;
        touched.lateral() <= support * radius && touched.value.abs() <= TOUCH_DEPTH * radius
    }

    /// Whether the scan has the touched shape here, in more detail.
    fn is_detail(
        &self,
        touched: Option<&FieldValue>,
        scan: &ScanDistance,
        swept_depth: f64,
    ) -> bool {
        let Some(agreement) = self.agreement.filter(|_| !scan.is_on_rim) else {
            return false;
        };
        if scan.value < 0.0 && !agreement.is_alike(-swept_depth.max(0.0), TouchedPart::Border) {
            return false;
        }
        let normal = touched.map_or(scan.normal, |touched| touched.gradient);
        let Some(around) = agreement.around(self.contacts, &scan.foot, &normal) else {
            return false;
        };
        let Some(touched) = touched else { return true };
        // at the end of a touched surface the scan may go around a blurred edge
        if around == ContactsAround::BentOrOpen && scan.normal.dot(&touched.gradient) < BENT {
            return false;
        }
        let part = match around {
            ContactsAround::Smooth => TouchedPart::Middle,
            ContactsAround::BentOrOpen if touched.is_edge => TouchedPart::Edge,
            _ if touched.lateral() > BORDER_SUPPORT * self.params.radius => TouchedPart::Beyond,
            _ if touched.is_border || touched.is_fan => TouchedPart::Border,
            ContactsAround::BentOrOpen => TouchedPart::Middle,
        };
        agreement.is_alike(scan.value - touched.value, part)
    }

    /// Whether a point out of reach of contacts and behind the scan is behind the part: a radius
    /// nearer to the scan it is in front of a touched surface that faces away from there, and
    /// farther away from both there is no other scan.
    fn is_behind_part(
        &self,
        scan: &ScanDistance,
        x: &Point3<f64>,
        scratch: &mut FieldScratch,
    ) -> bool {
        let Some(towards) = direction(&(scan.foot - x)).filter(|_| scan.value < 0.0) else {
            return false;
        };
        let nearer = x + towards * self.params.radius;
        let touched = self.params.field.at(self.contacts, &nearer, scratch);
        if !touched
            .is_some_and(|touched| touched.value > 0.0 && touched.gradient.dot(&towards) < -ALIKE)
        {
            return false;
        }
        AWAY.iter().all(|away| {
            let (beyond, farther) = (
                x + towards * (away * scan.value),
                (1.0 + away) * -scan.value,
            );
            self.tree
                .closest(self.scan, &beyond, ALONE * farther)
                .is_none()
        })
    }

    /// Value and weight of the touched surface beyond its support: straight on, unless the ball
    /// rolled over an edge there, and not out of the scan.
    fn straight_on(&self, touched: &FieldValue, scan: &ScanDistance) -> Option<(f64, f64)> {
        let p = self.params;
        let inside = (1.0 - scan.value / p.scan_reach).clamp(0.0, 1.0);
        let share =
            (p.field.reach - touched.lateral()) / (p.field.reach - BORDER_SUPPORT * p.radius);
        let goes_on = !touched.is_fan && touched.value.abs() <= TOUCH_DEPTH * p.radius;
        goes_on.then(|| (touched.value, inside * share.clamp(0.0, 1.0).powi(2)))
    }

    /// Whether two touched surfaces go straight on into an inner corner, at the point of the last
    /// evaluation.
    fn is_corner(&self, touched: &FieldValue, scratch: &FieldScratch) -> bool {
        let p = self.params;
        touched.value.abs() <= TOUCH_DEPTH * p.radius
            && is_inner_corner(self.contacts, &p.field, p.radius, scratch)
    }

    fn away_from_touches(&self, scan: &ScanDistance) -> Source {
        if scan.value.abs() > self.params.scan_reach {
            Source::Far
        } else if self.is_swept_away(scan) {
            Source::Nothing
        } else {
            Source::Scan
        }
    }

    /// Whether the scan holds at its foot: near, not swept, without contradiction by a contact
    /// beside it.
    fn scan_holds(&self, scan: &ScanDistance) -> bool {
        let p = self.params;
        if scan.value.abs() > p.scan_reach || scan.is_on_rim || self.is_swept_away(scan) {
            return false;
        }
        let (scan_removal, wall_removal) = (SCAN_REMOVAL * p.radius, p.radius / WALL_REMOVAL);
        let mut holds = !self
            .known
            .is_beside(&scan.foot, &scan.normal, scan_removal, ALIKE);
        self.contacts
            .near(&scan.foot, scan_removal, |distance_squared, index| {
                let contact = &self.contacts.means()[index as usize];
                let cosine = contact.normal.dot(&scan.normal);
                // a scan that faces a touched surface and is not clearly behind it leaves its wall
                // no thickness; in front of it the ball had no room for it
                let depth = contact.normal.dot(&(contact.point - scan.foot));
                let is_pierced = cosine < -ALIKE && depth < wall_removal;
                let limit = if cosine > ALIKE || is_pierced {
                    scan_removal
                } else {
                    wall_removal
                };
                holds &= distance_squared > limit * limit;
            });
        holds
    }

    fn is_swept_away(&self, scan: &ScanDistance) -> bool {
        let limit = self.params.radius + SWEPT_REACH * self.params.radius;
        self.free_space
            .nearest(&scan.foot)
            .is_some_and(|(distance, _)| distance < limit)
    }

    /// Depth of `x` in the space that the ball went through, m, and its centre there; `None` far
    /// from there.
    pub(in crate::reconstruct) fn free_depth(&self, x: &Point3<f64>) -> Option<(f64, Point3<f64>)> {
        let (distance, centre) = self.free_space.nearest(x)?;
        Some(((1.0 - SWEPT_MARGIN) * self.params.radius - distance, centre))
    }

    /// Depth of `x` in the space that the ball went through, m, and whether its path ended freely
    /// here.
    fn swept_depth(&self, x: &Point3<f64>) -> (f64, bool) {
        let p = self.params;
        let Some((depth, centre)) = self.free_depth(x) else {
            return (f64::NEG_INFINITY, false);
        };
        if depth <= 0.0 {
            return (depth, false);
        }
        let mut is_free = direction(&(x - centre))
            .is_some_and(|direction| self.free_space.is_end(&centre, &direction, p.radius / 2.0));
        self.contacts
            .near(&centre, FREE_REACH * p.radius, |_, _| is_free = false);
        (depth, is_free)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::reconstruct::{ContactSigma, SurfaceContact};
    use crate::stylus::{TipBody, TipPlace, TipShape};

    fn free_space(radius: f64) -> FreeSpace {
        FreeSpace::new(
            TipBody::new(TipShape::Ball, radius).unwrap(),
            0.05 * radius,
            2.0 * radius,
        )
    }

    /// Contacts on the face z = 0 up to the edge y = 0, and the places of a ball that rolls around
    /// it by 60°.
    fn face_with_a_rolled_edge(radius: f64) -> (ContactMap, FreeSpace) {
        let (mut contacts, mut rolled) = (
            ContactMap::new(radius / 3.0, 2.0 * radius, None),
            free_space(radius),
        );
        let along = || (-12..=12).map(|i| f64::from(i) * 0.25e-3);
        for (x, j) in along().flat_map(|x| (0..=16).map(move |j| (x, f64::from(j)))) {
            let (point, normal, sigma) = (
                Point3::new(x, -j * 0.25e-3, 0.0),
                Vector3::z(),
                ContactSigma::default(),
            );
            contacts.add(&SurfaceContact {
                point,
                normal,
                weight: 5.0,
                stamp_ns: 0,
                sigma,
            });
        }
        for (x, angle) in
            along().flat_map(|x| (0..=60).map(move |degrees| (x, f64::from(degrees).to_radians())))
        {
            let centre = Point3::new(x, radius * angle.sin(), radius * angle.cos());
            rolled.add_place(&TipPlace {
                centre,
                axis: Vector3::z(),
            });
        }
        (contacts, rolled)
    }

    /// The face z = 0 has contacts up to the edge y = 0, and the ball rolls around it by 60°: 0.5 r
    /// beyond, the face is 0.26 r deep in it.
    #[test]
    fn a_face_ends_where_the_ball_rolled_around_its_edge() {
        let radius = 1.5e-3;
        let (contacts, rolled) = face_with_a_rolled_edge(radius);
        let corners = vec![
            Point3::origin(),
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
        ];
        let scan = TriMesh::new(corners, vec![[0, 1, 2]]).unwrap();
        let (tree, params) = (FaceTree::new(&scan), EvidenceParams::new(radius, 0.3e-3));
        let nowhere = free_space(radius);
        let value = |free_space: &FreeSpace, y: f64| {
            let (contacts, scan, tree, params) = (&contacts, &scan, &tree, &params);
            let evidence = Evidence {
                params,
                contacts,
                free_space,
                known: &KnownSurfaces::new(radius),
                scan,
                tree,
                prior: None,
                agreement: None,
                is_closed: false,
            };
            evidence
                .touched(
                    &Point3::new(0.0, y, 0.0),
                    None,
                    &mut FieldScratch::default(),
                )
                .unwrap()
                .value
        };
        assert!(
            value(&nowhere, 0.5 * radius).abs() < 1e-9,
            "it would go straight on"
        );
        // deepest below the ball at an angle of 60°: r − |(0.5 − sin 60°, cos 60°)| r, less the
        // margin of 0.05 r
        let depth = radius * (1.0 - (0.5 - 0.75f64.sqrt()).hypot(0.5) - 0.05);
        assert!(
            (value(&rolled, 0.5 * radius) - depth).abs() < 0.02 * radius,
            "{}",
            value(&rolled, 0.5 * radius)
        );
        assert!(
            value(&rolled, -radius).abs() < 1e-9,
            "what was touched stays"
        );
    }
}
