//! Typical mistakes in a sound recording, and the cause that a check must name.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

use touchup_features::diagnose::InputCause;
use touchup_geometry::mesh::TriMesh;
use touchup_method::stylus::{Message, StampedPose, StampedWrench, TipParams};

/// A scan, a recording of its part, and the tip settings.
#[derive(Clone, Debug)]
pub struct ToldRecording {
    /// the scan, in its own frame, m
    pub scan: TriMesh,
    /// recorded poses and wrenches
    pub messages: Vec<Message>,
    /// tip settings
    pub tip: TipParams,
}

/// One way to get an input wrong.
#[derive(Clone, Copy, Debug)]
pub struct InputMistake {
    /// in words
    pub name: &'static str,
    /// cause that a check must report
    pub cause: InputCause,
    make: fn(ToldRecording) -> ToldRecording,
}

impl InputMistake {
    /// The recording with this mistake in it.
    pub fn made_of(&self, sound: &ToldRecording) -> ToldRecording {
        (self.make)(sound.clone())
    }
}

const fn mistake(
    name: &'static str,
    cause: InputCause,
    make: fn(ToldRecording) -> ToldRecording,
) -> InputMistake {
    InputMistake { name, cause, make }
}

/// Each mistake once.
pub const INPUT_MISTAKES: &[InputMistake] = &[
    mistake("wrench reversed", InputCause::WrenchSign, |x| {
        x.forces(|f| -f)
    }),
    mistake("wrench turned 90° about x", InputCause::WrenchFrame, |x| {
        x.forces(|f| Vector3::new(f.x, -f.z, f.y))
    }),
    mistake("wrench turned 90° about y", InputCause::WrenchFrame, |x| {
        x.forces(|f| Vector3::new(f.z, f.y, -f.x))
    }),
    mistake(
        "wrench's axes in another order",
        InputCause::WrenchFrame,
        |x| x.forces(|f| Vector3::new(f.y, f.z, f.x)),
    ),
    mistake("wrench's x and y reversed", InputCause::WrenchFrame, |x| {
        x.forces(|f| Vector3::new(-f.x, -f.y, f.z))
    }),
    mistake(
        "wrench turned 45° about the shaft",
        InputCause::WrenchFrame,
        |x| {
            x.forces(|f| {
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 45f64.to_radians()) * f
            })
        },
    ),
    mistake("quaternion w first", InputCause::QuaternionOrder, |x| {
        x.poses(read_w_first)
    }),
    mistake("tare 2 N", InputCause::Tare, |x| {
        x.forces(|f| f + Vector3::new(1.2, 0.0, -1.6))
    }),
    mistake("tare 5 N", InputCause::Tare, |x| {
        x.forces(|f| f + Vector3::new(0.0, 4.0, 3.0))
    }),
    mistake("tare 10 N", InputCause::Tare, |x| {
        x.forces(|f| f + Vector3::new(-6.0, 0.0, 8.0))
    }),
    mistake("wrench 20 ms late", InputCause::Delay, |x| x.late(20)),
    mistake("wrench 40 ms late", InputCause::Delay, |x| x.late(40)),
    mistake("wrench 80 ms late", InputCause::Delay, |x| x.late(80)),
    mistake("wrench 100 ms late", InputCause::Delay, |x| x.late(100)),
    mistake("wrench 40 ms early", InputCause::Delay, |x| x.late(-40)),
    mistake("wrench 100 ms early", InputCause::Delay, |x| x.late(-100)),
    mistake("two epochs", InputCause::TwoEpochs, |x| {
        x.wrenches(|w| w.stamp_ns -= 1_600_000_000_000_000_000)
    }),
    mistake("stamps of poses zero", InputCause::ZeroStamps, |x| {
        x.poses(|p| p.stamp_ns = 0)
    }),
    mistake("stamps of wrenches zero", InputCause::ZeroStamps, |x| {
        x.wrenches(|w| w.stamp_ns = 0)
    }),
    mistake("stamps in µs", InputCause::TimeUnit, |x| {
        x.poses(|p| p.stamp_ns /= 1000)
            .wrenches(|w| w.stamp_ns /= 1000)
    }),
    mistake("poses at 20 Hz", InputCause::SlowPoses, |x| {
        x.every_pose(25)
    }),
    mistake("scan in mm as inch", InputCause::LengthUnit, |x| {
        x.scan(|p| p * 25.4)
    }),
    mistake("scan in mm as m", InputCause::LengthUnit, |x| {
        x.scan(|p| p * 1e3)
    }),
    mistake("scan in m as mm", InputCause::LengthUnit, |x| {
        x.scan(|p| p * 1e-3)
    }),
    mistake("scan in inch as mm", InputCause::LengthUnit, |x| {
        x.scan(|p| p / 25.4)
    }),
    mistake("poses in mm", InputCause::LengthUnit, |x| {
        x.positions(|p| p * 1e3)
    }),
    mistake("tip in m", InputCause::Radius, |x| {
        x.tip(|tip| tip.radius *= 1e-3)
    }),
    mistake("radius times 2.5", InputCause::Radius, |x| {
        x.tip(|tip| tip.radius *= 2.5)
    }),
    mistake("radius times 4", InputCause::Radius, |x| {
        x.tip(|tip| tip.radius *= 4.0)
    }),
    mistake("stiffness a thousandth", InputCause::Stiffness, |x| {
        x.tip(|tip| tip.stiffness = tip.stiffness.map(|k| k / 1e3))
    }),
    mistake("force in gram", InputCause::ForceUnit, |x| {
        x.forces(|f| f * 101.97)
    }),
    mistake("force in kN", InputCause::ForceUnit, |x| {
        x.forces(|f| f * 1e-3)
    }),
    mistake("scan shifted 30 mm up", InputCause::Frame, |x| {
        x.scan(|p| p + Vector3::z() * 30e-3)
    }),
    mistake("scan shifted 30 mm aside", InputCause::Frame, |x| {
        x.scan(|p| p + Vector3::x() * 30e-3)
    }),
    mistake("scan turned 20°", InputCause::Frame, |x| {
        x.scan(|p| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 20f64.to_radians()) * p)
    }),
    mistake(
        "scan inside out",
        InputCause::InsideOut,
        ToldRecording::inside_out,
    ),
    mistake("flange in place of ball", InputCause::Frame, |x| {
        x.poses(|p| {
            p.pose_ot *= Isometry3::from_parts(
                Translation3::new(0.0, 0.0, 0.15),
                UnitQuaternion::identity(),
            )
        })
    }),
    mistake(
        "positions with y and z swapped",
        InputCause::PositionAxes,
        |x| x.positions(|p| p.xzy()),
    ),
    mistake("saturated", InputCause::Saturation, ToldRecording::clipped),
    mistake("light touch", InputCause::LightTouch, |x| {
        x.forces(|f| f * 0.08)
    }),
];

/// x, y, z, w read from a message with w first.
fn read_w_first(pose: &mut StampedPose) {
    let q = pose.pose_ot.rotation.coords;
    pose.pose_ot.rotation = UnitQuaternion::new_normalize(Quaternion::new(q.z, q.w, q.x, q.y));
}

impl ToldRecording {
    fn poses(mut self, change: impl Fn(&mut StampedPose)) -> Self {
        self.messages.iter_mut().for_each(|message| {
            if let Message::Pose(pose) = message {
                change(pose);
            }
        });
        self
    }

    fn wrenches(mut self, change: impl Fn(&mut StampedWrench)) -> Self {
        self.messages.iter_mut().for_each(|message| {
            if let Message::Wrench(wrench) = message {
                change(wrench);
            }
        });
        self
    }

    fn forces(self, change: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Self {
        self.wrenches(|wrench| wrench.wrench.force = change(wrench.wrench.force))
    }

    fn positions(self, change: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Self {
        self.poses(|pose| pose.pose_ot.translation.vector = change(pose.pose_ot.translation.vector))
    }

    fn scan(mut self, change: impl Fn(Point3<f64>) -> Point3<f64>) -> Self {
        (0..self.scan.vertex_slots() as u32)
            .map(touchup_geometry::mesh::VertexId)
            .for_each(|vertex| {
                let moved = change(self.scan.position(vertex));
                self.scan.set_position(vertex, moved);
            });
        self
    }

    fn inside_out(mut self) -> Self {
        let corners = |(_, [a, b, c]): (_, [touchup_geometry::mesh::VertexId; 3])| [a.0, c.0, b.0];
        let faces = self.scan.faces().map(corners).collect();
        // the same faces with reordered corners remain a valid mesh
        if let Ok(scan) = TriMesh::new(self.scan.positions().to_vec(), faces) {
            self.scan = scan;
        }
        self
    }

    fn tip(mut self, change: impl Fn(&mut TipParams)) -> Self {
        change(&mut self.tip);
        self
    }

    fn late(self, ms: i64) -> Self {
        self.wrenches(|wrench| wrench.stamp_ns += ms * 1_000_000)
    }

    /// Keeps one pose in `of`.
    fn every_pose(mut self, of: usize) -> Self {
        let mut count = 0;
        self.messages.retain(|message| {
            count += usize::from(matches!(message, Message::Pose(_)));
            matches!(message, Message::Wrench(_)) || count % of == 0
        });
        self
    }

    /// Forces clipped at half of the largest component.
    fn clipped(self) -> Self {
        let largest = self.messages.iter().map(|message| match message {
            Message::Wrench(wrench) => wrench.wrench.force.amax(),
            Message::Pose(_) => 0.0,
        });
        let range = 0.5 * largest.fold(0.0, f64::max);
        self.forces(|force| force.map(|x| x.clamp(-range, range)))
    }
}
