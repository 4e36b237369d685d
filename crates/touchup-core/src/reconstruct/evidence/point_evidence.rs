//! Evidence of touches, free space and the scan at one point.

use nalgebra::Point3;

use crate::mesh::{FaceTree, TriMesh};
use crate::reconstruct::evidence::contact_map::ContactMap;
use crate::reconstruct::evidence::free_space::FreeSpace;
use crate::reconstruct::evidence::scan_distance::ScanDistance;
use crate::reconstruct::field::inner_corner::is_inner_corner;
use crate::reconstruct::field::piecewise::{FieldParams, FieldScratch, FieldValue};

/// How each kind of evidence is weighted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvidenceParams {
    /// radius of the ball, or how large the tip is, m
    pub radius: f64,
    /// the fit of the contacts
    pub field: FieldParams,
    /// how deep the ball may seem to be in the surface by noise alone, m
    pub swept_margin: f64,
    /// contacts all around a point support it up to this distance along the surface, m
    pub inner_support: f64,
    /// the last contacts of a surface support what is beyond them up to this, m
    pub border_support: f64,
    /// two touched surfaces go on towards their common edge up to this, m
    pub edge_support: f64,
    /// the tilted plane at an edge that the ball rolled over goes on up to this, m
    pub fan_support: f64,
    /// a contact supports what is nearer to its surface than this, m: behind it may be another wall
    pub touch_depth: f64,
    /// the ball is free when nothing is touched within this distance of its centre, m
    pub free_reach: f64,
    /// the scan is rejected within this distance of a contact that faces alike, m
    pub scan_removal: f64,
    /// … of any contact, m
    pub wall_removal: f64,
    /// cosine of the widest angle between normals that face alike
    pub alike_cosine: f64,
    /// the scan supports what is nearer to it than this, m
    pub scan_reach: f64,
    /// a scan that the ball came nearer to than its radius and this was swept away, m
    pub swept_reach: f64,
}

impl EvidenceParams {
    /// Settings that hold for a ball of `radius` (m) and a scan whose points are off by `noise` (m).
    pub fn new(radius: f64, noise: f64) -> Self {
        Self {
            radius,
            field: FieldParams::for_ball(radius),
            swept_margin: 0.027 * radius,
            inner_support: 1.3 * radius,
            border_support: 0.75 * radius,
            edge_support: radius,
            fan_support: radius / 4.0,
            touch_depth: 0.8 * radius,
            free_reach: 1.5 * radius,
            scan_removal: 1.3 * radius,
            wall_removal: radius / 3.0,
            alike_cosine: 0.6,
            scan_reach: (3.0 * noise).max(radius / 2.0),
            swept_reach: 0.067 * radius,
        }
    }
}

/// The evidence for a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// the scan, which nothing contradicts
    Scan,
    /// touches
    Touch,
    /// the scan, beside touches of another surface
    Both,
    /// nothing nearby: to be filled
    Nothing,
    /// nothing, deep inside or far outside the scan: to be filled, with a pull towards the scan
    Far,
    /// nothing, beyond an open rim of the scan: the surface ends here
    Beyond,
}

/// What is known at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Finding {
    /// signed distance from the surface, m: positive outside; the scan's own where there is no better
    pub value: f64,
    /// the evidence for it
    pub source: Source,
    /// touches of two surfaces, going straight on to where they meet in an inner corner: nothing was touched here
    pub is_corner: bool,
    /// signed distance from the scan, m
    pub scan: f64,
    /// where there is nothing: the signed distance from a touched surface going straight on, m, and its
    /// weight, from 1 where its support ends down to 0 where it is out of reach
    pub straight: Option<(f64, f64)>,
    /// how deep the point is in the space that the ball went through, m; not more than 0 outside of it
    pub swept_depth: f64,
    /// the ball that went through it ended its path towards the point and touched nothing
    pub is_free_end: bool,
}

/// The scan is not used where it moves a touch by less than this share of what that may be off anyway.
const NOTICED: f64 = 0.1;

impl ScanPrior {
    /// The variance of a touch, m², unless the scan has no weight beside it: it moves a touch by gate × σₜ² / σₛ at most.
    fn comparable(&self, of_touch: f64) -> Option<f64> {
        (self.gate_sigmas * of_touch.sqrt() > NOTICED * self.sigma).then_some(of_touch)
    }
}

/// All evidence.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence<'a> {
    /// how it is weighted
    pub params: &'a EvidenceParams,
    /// what was touched
    pub contacts: &'a ContactMap,
    /// where the ball has been
    pub free_space: &'a FreeSpace,
    /// the original scan
    pub scan: &'a TriMesh,
    /// … and the tree over its faces
    pub tree: &'a FaceTree,
    /// how well the scan was known before; `None`: where something was touched it does not count
    pub prior: Option<ScanPrior>,
}

/// How well the scan is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScanPrior {
    /// standard deviation, m; more than 0
    pub sigma: f64,
    /// a scan that is off by more standard deviations shows something else
    pub gate_sigmas: f64,
}

impl Evidence<'_> {
    /// The evidence at `x` (m, in O), with the scan's part in `scan`.
    pub(in crate::reconstruct) fn beside(
        &self,
        scan: &ScanDistance,
        x: &Point3<f64>,
        scratch: &mut FieldScratch,
    ) -> Finding {
        let touched = self.touched_beside(x, || Some(*scan), scratch);
        let (mut value, mut source) = match &touched {
            Some(touched) => self.beside_touches(touched, scan),
            None => (scan.value, self.away_from_touches(scan)),
        };
        let (swept_depth, is_free_end) = self.swept_depth(x);
        if swept_depth > 0.0 && source != Source::Touch {
            (value, source) = (scan.value, Source::Nothing);
        }
        let is_corner = matches!(source, Source::Nothing | Source::Both)
            && touched
                .is_some_and(|touched| swept_depth <= touched.value.max(0.0) && self.is_corner(&touched, scratch));
        if let Some(touched) = touched.filter(|_| is_corner) {
            (value, source) = (touched.value, Source::Touch);
        }
        if scan.is_on_rim && !matches!(source, Source::Touch | Source::Both) {
            source = Source::Beyond;
        }
        let straight = touched.and_then(|touched| self.straight_on(&touched, scan));
        Finding { value, source, is_corner, scan: scan.value, straight, swept_depth, is_free_end }
    }

    /// The field of the touches at `x` (m, in O), which take the place of the scan by the gain σₛ² / (σₛ² + σₜ²) of the
    /// nearest one; `None` where none is within reach.
    pub fn touched(&self, x: &Point3<f64>, scratch: &mut FieldScratch) -> Option<FieldValue> {
        self.touched_beside(x, || ScanDistance::at(self.scan, self.tree, x), scratch)
    }

    fn touched_beside(
        &self,
        x: &Point3<f64>,
        scan: impl FnOnce() -> Option<ScanDistance>,
        scratch: &mut FieldScratch,
    ) -> Option<FieldValue> {
        let mut found = self.params.field.at(self.contacts, x, scratch)?;
        if let Some(prior) = self.prior
            && found.value.abs() < prior.gate_sigmas * prior.sigma
            && let Some(of_touch) = prior.comparable(self.contacts.variance(found.contact))
            && let Some(scan) = scan()
        {
            let is_alike = !scan.is_on_rim && scan.normal.dot(&found.gradient) > self.params.alike_cosine;
            let (off, of_both) = (scan.value - found.value, of_touch + prior.sigma * prior.sigma);
            if is_alike && off * off < prior.gate_sigmas * prior.gate_sigmas * of_both {
                found.value += off * of_touch / of_both;
            }
        }
        Some(found)
    }

    /// The field of the touches where they support the point, else that of the scan where it holds.
    fn beside_touches(&self, touched: &FieldValue, scan: &ScanDistance) -> (f64, Source) {
        let p = self.params;
        let lateral = touched.lateral();
        let support = match (touched.is_border, touched.is_fan) {
            _ if touched.is_edge => p.edge_support,
            (false, _) => p.inner_support,
            (true, false) => p.border_support,
            (true, true) => p.fan_support,
        };
        let is_supported = lateral <= support && touched.value.abs() <= p.touch_depth;
        if is_supported && (!touched.is_border || touched.is_edge) {
            return (touched.value, Source::Touch);
        }
        let is_wall = scan.normal.dot(&touched.gradient) < p.alike_cosine;
        let ends_at_wall = is_wall && scan.value > touched.value;
        if (ends_at_wall || !is_supported) && self.scan_holds(scan) {
            // a wall of the scan ends the surface that was touched
            return (if is_wall { scan.value.max(touched.value) } else { scan.value }, Source::Both);
        }
        if is_supported { (touched.value, Source::Touch) } else { (scan.value, Source::Nothing) }
    }

    /// The touched surface beyond its support: it goes straight on, unless the ball rolled over an edge there, and not out
    /// of the scan.
    fn straight_on(&self, touched: &FieldValue, scan: &ScanDistance) -> Option<(f64, f64)> {
        let p = self.params;
        let inside = (1.0 - scan.value / p.scan_reach).clamp(0.0, 1.0);
        let share = (p.field.reach - touched.lateral()) / (p.field.reach - p.border_support);
        let goes_on = !touched.is_fan && touched.value.abs() <= p.touch_depth;
        goes_on.then(|| (touched.value, inside * share.clamp(0.0, 1.0).powi(2)))
    }

    /// Whether two touched surfaces go straight on into an inner corner, there where the field was evaluated last.
    fn is_corner(&self, touched: &FieldValue, scratch: &FieldScratch) -> bool {
        let p = self.params;
        touched.value.abs() <= p.touch_depth && is_inner_corner(self.contacts, &p.field, p.radius, scratch)
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

    /// Whether the scan holds at its foot: near, not swept, and no contact beside it contradicts it.
    fn scan_holds(&self, scan: &ScanDistance) -> bool {
        let p = self.params;
        if scan.value.abs() > p.scan_reach || scan.is_on_rim || self.is_swept_away(scan) {
            return false;
        }
        let mut holds = true;
        self.contacts.near(&scan.foot, p.scan_removal, |distance_squared, index| {
            let contact = &self.contacts.means()[index as usize];
            let cosine = contact.normal.dot(&scan.normal);
            // a scan that faces a touched surface and is not clearly behind it leaves its wall no thickness; in front of
            // it the ball had no room for it
            let depth = contact.normal.dot(&(contact.point - scan.foot));
            let is_pierced = cosine < -p.alike_cosine && depth < p.wall_removal;
            let limit = if cosine > p.alike_cosine || is_pierced { p.scan_removal } else { p.wall_removal };
            holds &= distance_squared > limit * limit;
        });
        holds
    }

    fn is_swept_away(&self, scan: &ScanDistance) -> bool {
        let limit = self.params.radius + self.params.swept_reach;
        self.free_space.nearest(&scan.foot).is_some_and(|(distance, _)| distance < limit)
    }

    /// How deep `x` lies in the space that the ball went through, m, and whether that ball ended its path here freely.
    fn swept_depth(&self, x: &Point3<f64>) -> (f64, bool) {
        let p = self.params;
        let Some((distance, centre)) = self.free_space.nearest(x) else { return (f64::NEG_INFINITY, false) };
        let depth = p.radius - p.swept_margin - distance;
        if depth <= 0.0 {
            return (depth, false);
        }
        let mut is_free = (x - centre)
            .try_normalize(0.0)
            .is_some_and(|direction| self.free_space.is_end(&centre, &direction, p.radius / 2.0));
        self.contacts.near(&centre, p.free_reach, |_, _| is_free = false);
        (depth, is_free)
    }
}
