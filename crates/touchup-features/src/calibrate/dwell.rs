//! Points picked by a dwell of the stylus on the part.
//!
//! While it presses and stays in place, the means of its ball and force give one point: c + F / k −
//! r n, with the stiffness k of the stylus and n along the force. Friction lets a resting force
//! lean: if the pressing hand slopes by φ the point is off by r sin φ along the surface.

use nalgebra::{Point3, Vector3};

use touchup_method::stylus::ContactSample;

/// Settings of a [`DwellFinder`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DwellParams {
    /// Shortest dwell, ns. Default 0.5 s: longer than a turning point of a stroke.
    pub dwell_ns: i64,
    /// Largest distance of the ball from its place at the start, m. Default 0.5 mm: a hand trembles
    /// by a tenth of that.
    pub largest_drift: f64,
    /// Radius of the ball, m.
    pub radius: f64,
}

impl Default for DwellParams {
    /// The parameters of a point tip.
    fn default() -> Self {
        Self {
            dwell_ns: 500_000_000,
            largest_drift: 0.5e-3,
            radius: 0.0,
        }
    }
}

/// A point picked by a dwell of the stylus on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dwell {
    /// The point on the part, in the frame of the poses, m.
    pub point: Point3<f64>,
    /// Start of the dwell, ns.
    pub begin_ns: i64,
    /// Duration of the dwell, s.
    pub seconds: f64,
    /// Mean force, in the frame of the poses, N.
    pub force: Vector3<f64>,
}

/// A part of a recording with the ball in one place.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    anchor: Vector3<f64>,
    begin_ns: i64,
    end_ns: i64,
    centre: Vector3<f64>,
    force: Vector3<f64>,
    count: f64,
}

/// Finds dwells in samples in order of time.
#[derive(Debug)]
pub struct DwellFinder {
    params: DwellParams,
    stretch: Option<Stretch>,
    found: Vec<Dwell>,
}

impl DwellFinder {
    /// A finder without samples.
    pub fn new(params: DwellParams) -> Self {
        Self {
            params,
            stretch: None,
            found: Vec::new(),
        }
    }

    /// Adds the next sample, in order of time; O is the frame of the poses.
    pub fn push(&mut self, sample: &ContactSample) {
        if !sample.is_in_contact() {
            return self.close();
        }
        let (tip, centre) = (&sample.tip, sample.centre.coords);
        if self
            .stretch
            .is_some_and(|stretch| (centre - stretch.anchor).norm() > self.params.largest_drift)
        {
            self.close();
        }
        let (begin_ns, zero) = (tip.stamp_ns, Vector3::zeros());
        let new = Stretch {
            anchor: centre,
            begin_ns,
            end_ns: begin_ns,
            centre: zero,
            force: zero,
            count: 0.0,
        };
        let stretch = self.stretch.get_or_insert(new);
        stretch.end_ns = tip.stamp_ns;
        stretch.centre += centre;
        stretch.force += tip.force_o;
        stretch.count += 1.0;
    }

    /// The dwells, in order of time.
    pub fn finish(mut self) -> Vec<Dwell> {
        self.close();
        self.found
    }

    fn close(&mut self) {
        let Some(Stretch {
            begin_ns,
            end_ns,
            centre,
            force,
            count,
            ..
        }) = self.stretch.take()
        else {
            return;
        };
        let lasted_ns = end_ns.saturating_sub(begin_ns);
        let (centre, force) = (centre / count, force / count);
        if let (true, Some(normal)) = (lasted_ns >= self.params.dwell_ns, force.try_normalize(0.0))
        {
            let point = Point3::from(centre - normal * self.params.radius);
            self.found.push(Dwell {
                point,
                begin_ns,
                seconds: lasted_ns as f64 * 1e-9,
                force,
            });
        }
    }
}
