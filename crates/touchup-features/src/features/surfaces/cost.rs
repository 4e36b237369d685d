//! How well a surface explains contacts, and its price.

use super::contact::ContactCell;
use super::contacts::Contacts;
use super::shape::TouchedShape;
use crate::features::segmentation::primitive::Primitive;

/// Maximum misfit of a contact on its surface, in standard deviations.
const NEAR: f64 = 3.5;
/// Weight of the misfit of a contact beside its presence: contacts of one pass share their error.
const OF_MISFIT: f64 = 0.1;
/// Price of a surface, and of each of its freedoms times half the logarithm of the number of its
/// contacts, in contacts.
const PRICE: f64 = 5.0;
const PRICE_OF_FREEDOM: f64 = 5.0;
/// Cosines between the normals of two surfaces that meet in an edge.
const BESIDE_LAND: std::ops::Range<f64> = -0.7..0.95;
/// Cosine of the maximum lean of a contact at the edge of its surface: 75°; error of that lean, rad.
const ROLLED: f64 = 0.26;
const TURNED: f64 = 0.12;
/// Share of a contact at an edge that each of the two surfaces explains that meet there.
const OF_EDGE: f64 = 0.5;
/// Maximum number of contacts in a fit.
pub(super) const MOST_FITTED: usize = 300;

/// A surface and its contacts.
pub(super) struct SurfaceRegion {
    pub shape: TouchedShape,
    /// numbers of its contacts
    pub contacts: Vec<u32>,
    /// explained contacts less its price
    pub gain: f64,
}

/// Costs of surfaces over contacts.
#[derive(Clone, Copy)]
pub(super) struct Costs<'a> {
    pub contacts: &'a Contacts,
    /// maximum misfit of a contact on its surface, m
    pub near: f64,
}

impl<'a> Costs<'a> {
    pub(super) fn of(contacts: &'a Contacts) -> Self {
        Self {
            contacts,
            near: NEAR * contacts.noise.centre,
        }
    }

    /// At most `most` of some contacts, evenly spread.
    pub(super) fn some(&self, numbers: &[u32], most: usize) -> Vec<&'a ContactCell> {
        let step = numbers.len().div_ceil(most).max(1);
        let some = numbers.iter().step_by(step);
        some.map(|&at| &self.contacts.all[at as usize]).collect()
    }

    /// Misfit of a contact with a surface, of its centre and its normal, in the maximum; `None`:
    /// beyond that.
    #[inline]
    pub(super) fn misfit(&self, primitive: &Primitive, at: u32) -> Option<f64> {
        let contact = &self.contacts.all[at as usize];
        let (distance, normal) = primitive.distance_and_normal(&contact.centre);
        let off = (distance - contact.radius) / (contact.slack * self.near);
        let normal = match &contact.land {
            None => normal,
            // each surface through an edge shows the same direction along its land
            Some(land) => {
                let up = normal.dot(&land.normal);
                if !BESIDE_LAND.contains(&up) {
                    return None;
                }
                (normal - land.normal * up).normalize()
            }
        };
        // 2 (1 − cos θ) ≈ θ²; rounding may take a cosine beyond 1
        let turned = (2.0 * (1.0 - normal.dot(&contact.normal))).max(0.0);
        let square = off * off + turned / (NEAR * self.contacts.noise.normal).powi(2);
        (square < 1.0).then(|| square.sqrt())
    }

    /// The same at the edge of a surface: where the ball rolls over it, the contact itself is on the
    /// surface, and the normal leans.
    pub(super) fn misfit_at_edge(&self, primitive: &Primitive, at: u32) -> Option<f64> {
        let contact = &self.contacts.all[at as usize];
        let (distance, normal) = primitive.distance_and_normal(&contact.centre);
        let cosine = normal.dot(&contact.normal);
        if contact.land.is_some() || cosine < ROLLED || distance > contact.radius {
            return None;
        }
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let near = self.near.hypot(NEAR * TURNED * contact.radius * sine);
        let off = (distance - contact.radius * cosine).abs() / near;
        (off < 1.0).then_some(off)
    }

    /// Explained share of a contact with a misfit.
    pub(super) fn score(misfit: f64) -> f64 {
        1.0 - OF_MISFIT * misfit * misfit
    }

    /// Explained share of a contact on a surface; 0 beyond.
    pub(super) fn explained(&self, primitive: &Primitive, at: u32) -> f64 {
        self.misfit(primitive, at).map_or(0.0, Self::score)
    }

    /// The same on the surface or at its edge; `None`: neither.
    pub(super) fn explained_with_edge(&self, primitive: &Primitive, at: u32) -> Option<f64> {
        let on_face = self.misfit(primitive, at).map(Self::score);
        on_face.or_else(|| {
            let at_edge = self.misfit_at_edge(primitive, at);
            at_edge.map(|misfit| OF_EDGE * Self::score(misfit))
        })
    }

    pub(super) fn price(shape: &TouchedShape, count: usize) -> f64 {
        PRICE + shape.freedoms() * PRICE_OF_FREEDOM * (1.0 + count as f64).ln() / 2.0
    }

    /// Contacts that a surface explains, less its price.
    pub(super) fn gain(&self, shape: &TouchedShape, region: &[u32]) -> f64 {
        let explained = region
            .iter()
            .map(|&at| self.explained(&shape.primitive, at));
        explained.sum::<f64>() - Self::price(shape, region.len())
    }

    /// A region with its gain.
    pub(super) fn region(&self, shape: TouchedShape, contacts: Vec<u32>) -> SurfaceRegion {
        let gain = self.gain(&shape, &contacts);
        SurfaceRegion {
            shape,
            contacts,
            gain,
        }
    }

    /// A shape fitted again to its contacts.
    pub(super) fn refitted(&self, shape: &TouchedShape, contacts: &[u32]) -> Option<TouchedShape> {
        shape.refitted(&self.some(contacts, MOST_FITTED), self.near)
    }
}
