//! The detail of a scan that is finer than the tip, where it agrees with the touches: the scan is moved there and not replaced.
//!
//! For each mean contact j the scan says where the ball would have been stopped: off by δⱼ = |x − c| − r, with the centre of the ball
//! c = pⱼ + r nⱼ and the closest point x of the scan. Where these mismatches vary smoothly, the scan has the shape that was felt, and
//! is moved by their weighted mean
//!
//! u(x) = s(d) Σ wⱼ δⱼ nⱼ / Σ wⱼ,   wⱼ = Wⱼ exp(−(|x − pⱼ|² − d²) / max(σ², d²/2)),
//!
//! where d is the distance to the nearest contact that agrees; s falls smoothly from 1 within a radius to 0 at two.

use nalgebra::Vector3;

use crate::mesh::{BoxQuery, FaceTree, TriMesh, VertexId};
use crate::reconstruct::contour::patched::Support;
use crate::reconstruct::evidence::agreement::{Agreement, LARGEST_MISMATCH, RESTS};
use crate::reconstruct::evidence::contact_map::MeanContact;
use crate::reconstruct::evidence::point_evidence::Evidence;

/// A scan is finer than the tip when its edges are shorter than this, in radii.
const FINE: f64 = 0.36;
/// Cosine of the widest angle between the arm to the scan and the normal of the contact.
const ALONG: f64 = 0.9;
/// A contact agrees when its mismatch is that around it but for this, in radii: 0.05 mm for a ball of 1.5 mm.
const AGREES: f64 = 1.0 / 30.0;
/// … and for so many standard deviations of its own.
const SIGMAS: f64 = 2.0;
/// Vertices may scatter by this around the mean of their neighbours, in radii (root mean square): more is noise that touches do better.
const SCATTER: f64 = 0.005;
/// Around a contact the scatter is looked at within this, in radii.
const AROUND: f64 = 1.0 / 3.0;

/// The scan, moved to where it was touched, and the contacts that it agrees with.
#[derive(Clone, Debug)]
pub(in crate::reconstruct) struct KeptDetail {
    /// the scan with `moved` elsewhere
    pub scan: TriMesh,
    /// … with the tree over its faces
    pub tree: FaceTree,
    /// vertices that are elsewhere, and what they rest on
    pub moved: Vec<(VertexId, Support)>,
    pub agreement: Agreement,
}

impl KeptDetail {
    /// Finds where the scan agrees, and moves it; `None` where it is no finer than the tip, or agrees nowhere.
    pub fn of(evidence: &Evidence<'_>) -> Option<Self> {
        let (scan, tree, radius) = (evidence.scan, evidence.tree, evidence.params.radius);
        if !evidence.free_space.is_of_ball() || scan.mean_edge() >= FINE * radius {
            return None;
        }
        let agreement = agreement_of(evidence);
        if agreement.mismatch.iter().all(Option::is_none) {
            return None;
        }
        let mut is_near = vec![false; scan.vertex_slots()];
        let mut near = BoxQuery::default();
        for (contact, _) in agreement.agreeing(evidence.contacts) {
            let reach = Vector3::repeat(RESTS * radius);
            tree.faces_in_box(&(contact.point - reach), &(contact.point + reach), &mut near);
            near.faces.iter().flat_map(|&face| scan.corners(face)).for_each(|v| is_near[v.0 as usize] = true);
        }
        let (mut moved_scan, mut moved) = (scan.clone(), Vec::new());
        for vertex in (0..is_near.len() as u32).filter(|&v| is_near[v as usize]).map(VertexId) {
            let here = scan.position(vertex);
            let (step, share) = agreement.displacement(evidence.contacts, &here);
            if step != Vector3::zeros() {
                moved_scan.set_position(vertex, here + step);
                moved.push((vertex, if share < 1.0 { Support::Guessed } else { Support::Touched }));
            }
        }
        let tree = FaceTree::new(&moved_scan);
        Some(Self { scan: moved_scan, tree, moved, agreement })
    }
}

/// Looks at each contact alone, then beside the others.
fn agreement_of(evidence: &Evidence<'_>) -> Agreement {
    let (contacts, radius) = (evidence.contacts, evidence.params.radius);
    let mut near = BoxQuery::default();
    let alone = contacts.means().iter().map(|contact| {
        let mismatch = if contact.weight > 0.0 { mismatch_of(evidence, contact)? } else { return None };
        is_fine(evidence, contact, &mut near).then_some(mismatch)
    });
    let mut agreement = Agreement { mismatch: alone.collect(), radius };
    let agrees = |((contact, mismatch), index): ((&MeanContact, &Option<f64>), u32)| {
        let mismatch = (*mismatch)?;
        let around = agreement.displacement(contacts, &contact.point).0.dot(&contact.normal);
        let may_be_off = AGREES * radius + SIGMAS * contacts.variance(index).sqrt();
        ((around - mismatch).abs() <= may_be_off).then_some(mismatch)
    };
    agreement.mismatch = contacts.means().iter().zip(&agreement.mismatch).zip(0..).map(agrees).collect();
    agreement
}

/// How far the ball of a contact is above the scan, m; negative: in it.
fn mismatch_of(evidence: &Evidence<'_>, contact: &MeanContact) -> Option<f64> {
    let radius = evidence.params.radius;
    let centre = contact.point + contact.normal * radius;
    let hit = evidence.tree.closest(evidence.scan, &centre, (1.0 + LARGEST_MISMATCH) * radius)?;
    let arm = centre - hit.point;
    let distance = arm.norm();
    let is_along = arm.dot(&contact.normal) > ALONG * distance;
    (is_along && distance > (1.0 - LARGEST_MISMATCH) * radius).then_some(distance - radius)
}

/// Whether the scan around a contact is finer than the tip, and its vertices scatter less than touches do.
fn is_fine(evidence: &Evidence<'_>, contact: &MeanContact, near: &mut BoxQuery) -> bool {
    let (scan, radius) = (evidence.scan, evidence.params.radius);
    let reach = Vector3::repeat(AROUND * radius);
    evidence.tree.faces_in_box(&(contact.point - reach), &(contact.point + reach), near);
    let (mut longest, mut sum, mut count) = (0.0f64, 0.0, 0.0);
    for &face in &near.faces {
        let [corner, next, _] = scan.corners(face);
        longest = longest.max((scan.position(next) - scan.position(corner)).norm_squared());
        // the mean of the neighbours of a corner: each counts once for either face at its edge
        let star = scan.star(corner);
        let around = star.iter().flat_map(|&face| scan.corners(face)).filter(|other| *other != corner);
        let mean = around.fold(Vector3::zeros(), |sum, other| sum + scan.position(other).coords);
        let off = scan.position(corner).coords - mean / (2.0 * star.len() as f64);
        sum += off.dot(&scan.normal(face)).powi(2);
        count += 1.0;
    }
    count > 0.0 && longest < (2.0 * FINE * radius).powi(2) && sum < count * (SCATTER * radius).powi(2)
}
