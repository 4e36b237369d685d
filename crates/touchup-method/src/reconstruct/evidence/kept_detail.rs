//! Scan detail finer than the tip that agrees with the touches: the scan moves there instead of
//! being replaced.
//!
//! For each mean contact j the scan predicts the stop of the ball: off by δⱼ = |x − c| − r, with
//! the centre of the ball c = pⱼ + r nⱼ and the closest point x of the scan. If these mismatches
//! vary smoothly, the scan has the touched shape, and moves by their weighted mean
//!
//! u(x) = s(d) Σ wⱼ δⱼ nⱼ / Σ wⱼ,   wⱼ = Wⱼ exp(−(|x − pⱼ|² − d²) / max(σ², d²/2)),
//!
//! with d the distance to the nearest agreeing contact; s falls smoothly from 1 within a radius to
//! 0 at two.

use nalgebra::Vector3;

use crate::reconstruct::evidence::agreement::{Agreement, LARGEST_MISMATCH, RESTS};
use crate::reconstruct::evidence::contact_map::{ContactMap, MeanContact};
use crate::reconstruct::evidence::point_evidence::Evidence;
use crate::reconstruct::lattice::VertexKey;
use crate::reconstruct::support::Support;
use touchup_geometry::mesh::{BoxQuery, FaceTree, TriMesh, VertexId};
use touchup_geometry::numeric::median;

/// Maximum edge length of a scan finer than the tip, in radii.
const FINE: f64 = 0.36;
/// Cosine of the maximum angle between the arm to the scan and the normal of the contact.
const ALONG: f64 = 0.9;
/// Maximum difference between the mismatch of an agreeing contact and that around it, in radii:
/// 0.075 mm for a ball of 1.5 mm.
const AGREES: f64 = 0.05;
/// Standard deviations of the contact added to [`AGREES`].
const SIGMAS: f64 = 2.0;
/// Width b of the average of the residual mismatches, and its range, in radii.
const AVERAGED: f64 = 0.5;
const AVERAGED_WITHIN: f64 = 1.2;
/// Maximum averaged residual, l, in standard deviations.
const LIMIT: f64 = 3.0;
/// Slack ε of the averaged residual, in radii: 4.5 µm for a ball of 1.5 mm.
const SLACK: f64 = 0.003;
/// Maximum scatter of vertices across the straightest line through them, in radii (median): more is
/// noise, which touches beat, of 8 µm for a ball of 1.5 mm. Engraved lines are straight.
const SCATTER: f64 = 0.002;
/// Range of the scatter around a contact, in radii.
const AROUND: f64 = 1.0 / 3.0;

/// The scan, moved to the touches, and the contacts that it agrees with.
#[derive(Clone, Debug)]
pub(in crate::reconstruct) struct KeptDetail {
    /// the scan with `moved` displaced
    pub scan: TriMesh,
    /// tree over the faces of `scan`
    pub tree: FaceTree,
    /// displaced vertices, by their ids, and their support
    pub moved: Vec<(VertexId, Support)>,
    pub agreement: Agreement,
}

impl KeptDetail {
    /// Finds agreement, and moves the scan; `None` unless the scan is finer than the tip and agrees
    /// somewhere.
    pub(crate) fn of(evidence: &Evidence<'_>) -> Option<Self> {
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
            tree.faces_in_box(
                &(contact.point - reach),
                &(contact.point + reach),
                &mut near,
            );
            near.faces
                .iter()
                .flat_map(|&face| scan.corners(face))
                .for_each(|v| is_near[v.0 as usize] = true);
        }
        let (mut moved_scan, mut moved) = (scan.clone(), Vec::new());
        for vertex in (0..is_near.len() as u32)
            .filter(|&v| is_near[v as usize])
            .map(VertexId)
        {
            let here = scan.position(vertex);
            let (step, share) = agreement.displacement(evidence.contacts, &here);
            if step != Vector3::zeros() {
                moved_scan.set_position(vertex, here + step);
                moved.push((
                    vertex,
                    if share < 1.0 {
                        Support::Guessed
                    } else {
                        Support::Touched
                    },
                ));
            }
        }
        let tree = FaceTree::new(&moved_scan);
        Some(Self {
            scan: moved_scan,
            tree,
            moved,
            agreement,
        })
    }

    /// Support of a patch vertex on the scan; `None` for any other.
    pub(crate) fn support(&self, key: &VertexKey) -> Option<Support> {
        let of = |vertex: &VertexId| {
            let at = self
                .moved
                .binary_search_by_key(&vertex.0, |(moved, _)| moved.0);
            at.map_or(Support::Scan, |at| self.moved[at].1)
        };
        let of_all = |vertices: &[VertexId]| {
            let first = of(&vertices[0]);
            if vertices.iter().all(|vertex| of(vertex) == first) {
                first
            } else {
                Support::Guessed
            }
        };
        match key {
            VertexKey::Scan(vertex) => Some(of(vertex)),
            VertexKey::Trace { ends, .. } => Some(of_all(ends)),
            VertexKey::Pierce(_, face) => Some(of_all(&self.scan.corners(*face))),
            VertexKey::Cell(..) | VertexKey::Square(..) | VertexKey::Edge(_) => None,
        }
    }
}

/// Compares each contact alone, then beside the others: the residuals of their mismatches, ρⱼ = δⱼ
/// − u(pⱼ)·nⱼ, must not exceed the noise of touches. The window smooths a ball bounced by engraved
/// lines, so the residual is averaged first, ρ̄ = Σ gₖ ρₖ / Σ gₖ with variance Σ gₖ² σₖ² / (Σ gₖ)²,
/// gₖ = wₖ exp(−|pₖ − pⱼ|² / b²); then over the contacts within a radius
///
/// Σ wⱼ ρ̄ⱼ² ≤ Σ wⱼ (l² σ̄ⱼ² + ε²).
fn agreement_of(evidence: &Evidence<'_>) -> Agreement {
    let (contacts, radius) = (evidence.contacts, evidence.params.radius);
    let mut fineness = Fineness::new(evidence);
    let alone = contacts.means().iter().map(|contact| {
        let mismatch = if contact.weight > 0.0 {
            mismatch_of(evidence, contact)?
        } else {
            return None;
        };
        fineness.is_fine(contact).then_some(mismatch)
    });
    let mut agreement = Agreement {
        mismatch: alone.collect(),
        radius,
    };
    let rest = |(contact, mismatch): (&MeanContact, &Option<f64>)| {
        Some(
            (*mismatch)?
                - agreement
                    .displacement(contacts, &contact.point)
                    .0
                    .dot(&contact.normal),
        )
    };
    let rest: Vec<Option<f64>> = contacts
        .means()
        .iter()
        .zip(&agreement.mismatch)
        .map(rest)
        .collect();
    let averaged: Vec<[f64; 2]> = contacts
        .means()
        .iter()
        .map(|contact| averaged_residual(contacts, &rest, radius, contact))
        .collect();
    let agrees = |(index, mismatch): (u32, &Option<f64>)| {
        let (mismatch, own) = ((*mismatch)?, rest[index as usize]?);
        let (mut left, mut noise) = (0.0, 0.0);
        contacts.near(
            &contacts.means()[index as usize].point,
            radius,
            |_, index| {
                if rest[index as usize].is_some() {
                    let weight = contacts.means()[index as usize].weight;
                    left += weight * averaged[index as usize][0];
                    noise += weight * averaged[index as usize][1];
                }
            },
        );
        let may_be_off = AGREES * radius + SIGMAS * contacts.variance(index).sqrt();
        (own.abs() <= may_be_off && left <= noise).then_some(mismatch)
    };
    agreement.mismatch = (0..).zip(&agreement.mismatch).map(agrees).collect();
    agreement
}

/// Squared averaged residual ρ̄² at a contact, and its limit, m².
///
/// - `rest`: residual of each contact, m.
fn averaged_residual(
    contacts: &ContactMap,
    rest: &[Option<f64>],
    radius: f64,
    contact: &MeanContact,
) -> [f64; 2] {
    let (mut sum, mut variance, mut weights) = (0.0, 0.0, 0.0);
    contacts.near(
        &contact.point,
        AVERAGED_WITHIN * radius,
        |distance_squared, index| {
            if let Some(rest) = rest[index as usize] {
                let weight = contacts.means()[index as usize].weight
                    * (-distance_squared / (AVERAGED * radius).powi(2)).exp();
                sum += weight * rest;
                variance += weight * weight * contacts.noise_variance(index);
                weights += weight;
            }
        },
    );
    let noise = LIMIT * LIMIT * variance / (weights * weights) + (SLACK * radius).powi(2);
    [(sum / weights).powi(2), noise]
}

/// Height of a contact's ball above the scan, m; negative: in it.
fn mismatch_of(evidence: &Evidence<'_>, contact: &MeanContact) -> Option<f64> {
    let radius = evidence.params.radius;
    let centre = contact.point + contact.normal * radius;
    let hit = evidence
        .tree
        .closest(evidence.scan, &centre, (1.0 + LARGEST_MISMATCH) * radius)?;
    let arm = centre - hit.point;
    let distance = arm.norm();
    let is_along = arm.dot(&contact.normal) > ALONG * distance;
    (is_along && distance > (1.0 - LARGEST_MISMATCH) * radius).then_some(distance - radius)
}

/// Test for parts of the scan finer than the tip, with vertices that scatter less than touches.
struct Fineness<'a> {
    evidence: &'a Evidence<'a>,
    /// by vertex, m; NaN: not yet computed
    scatter: Vec<f64>,
    near: BoxQuery,
    around: Vec<f64>,
}

impl<'a> Fineness<'a> {
    fn new(evidence: &'a Evidence<'a>) -> Self {
        let scatter = vec![f64::NAN; evidence.scan.vertex_slots()];
        Self {
            evidence,
            scatter,
            near: BoxQuery::default(),
            around: Vec::new(),
        }
    }

    /// Whether the scan is fine around a contact.
    fn is_fine(&mut self, contact: &MeanContact) -> bool {
        let (scan, radius) = (self.evidence.scan, self.evidence.params.radius);
        let reach = Vector3::repeat(AROUND * radius);
        self.evidence.tree.faces_in_box(
            &(contact.point - reach),
            &(contact.point + reach),
            &mut self.near,
        );
        let mut longest = 0.0f64;
        self.around.clear();
        for &face in &self.near.faces {
            let [corner, next, _] = scan.corners(face);
            longest = longest.max((scan.position(next) - scan.position(corner)).norm_squared());
            let scatter = &mut self.scatter[corner.0 as usize];
            if scatter.is_nan() {
                *scatter = scatter_of(scan, corner);
            }
            self.around.push(*scatter);
        }
        longest < (2.0 * FINE * radius).powi(2)
            && median(&mut self.around).is_some_and(|middle| middle < SCATTER * radius)
    }
}

/// Distance of a vertex from the straightest of the lines through it from one neighbour to the one
/// across, along its normal, m.
fn scatter_of(scan: &TriMesh, vertex: VertexId) -> f64 {
    let star = scan.star(vertex);
    let normal = star
        .iter()
        .map(|&face| scan.double_area_normal(face))
        .sum::<Vector3<f64>>();
    let here = scan.position(vertex);
    let others = || {
        star.iter()
            .flat_map(|&face| scan.corners(face))
            .filter(|other| *other != vertex)
    };
    let arms = || others().map(|other| scan.position(other) - here);
    let off = |arm: Vector3<f64>| {
        let cosine = |other: &Vector3<f64>| arm.dot(other) / other.norm();
        let across = arms().min_by(|a, b| cosine(a).total_cmp(&cosine(b)))?;
        // the foot of the vertex on the line between the two ends
        let line = across - arm;
        let foot = arm - line * (arm.dot(&line) / line.norm_squared());
        Some(foot.dot(&normal).abs() / normal.norm())
    };
    arms().filter_map(off).fold(f64::INFINITY, f64::min)
}
