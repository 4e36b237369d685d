//! Mistakes made of sound recordings, and the cause that is named.

use crate::full::is_full;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use touchup::diagnose::{InputCause, InputFinding, InputMonitor, InputMonitorParams};
use touchup::mesh::{FaceTree, TriMesh};
use touchup::sim::{PathParams, Plate, ScannerParams, SensorParams, StylusParams, plan_demo, scan, touch};
use touchup::stylus::{
    CompensatorParams, ContactEstimator, ContactEstimatorParams, Message, StampedPose, StampedWrench, SyncParams,
    Synchroniser, TipParams, TipShape,
};

/// A scan, the messages of a stylus, and what is told of it.
#[derive(Clone)]
struct Input {
    scan: TriMesh,
    messages: Vec<Message>,
    tip: TipParams,
}

/// Another stylus, sensor and scan for each seed.
fn simulated(seed: u64) -> Input {
    let radius = [1.5e-3, 0.8e-3, 3e-3, 2e-3][seed as usize % 4];
    let stiffness = [20e3, 200e3, 10e3, 50e3, 15e3][seed as usize % 5];
    let times = [1.0, 0.3, 1.5][seed as usize % 3];
    let friction = [0.15, 0.05, 0.3, 0.2][seed as usize % 4];
    let plate = Plate::default();
    let usual = SensorParams::default();
    let sensor = SensorParams { pose_noise: usual.pose_noise * times, force_noise: usual.force_noise * times, ..usual };
    let stylus = StylusParams { radius, stiffness, friction, sensor, ..StylusParams::default() };
    let path = plan_demo(&plate, &PathParams { radius, ..PathParams::default() }).unwrap();
    let messages = touch(&plate, &path, &stylus, seed).unwrap().messages;
    let usual = ScannerParams::default();
    let scan = scan(&plate, &ScannerParams { noise: usual.noise * times, seed, ..usual }).unwrap();
    Input { scan, messages, tip: TipParams { radius, stiffness: Some(stiffness) } }
}

fn findings(input: &Input) -> Vec<InputFinding> {
    let sync = SyncParams::default();
    let contact = ContactEstimatorParams::new(input.tip);
    let mut monitor = InputMonitor::new(InputMonitorParams {
        compensator: CompensatorParams::default(),
        tip: input.tip,
        shape: TipShape::Ball,
        scan_noise: 0.0,
        contact_on: contact.gate.map(|gate| gate.on),
        sync,
    })
    .unwrap();
    let (mut sync, mut contacts) = (Synchroniser::new(sync).unwrap(), ContactEstimator::new(contact).unwrap());
    let mut take = |sync: &mut Synchroniser, monitor: &mut InputMonitor| {
        while let Some(sample) = sync.next_sample() {
            monitor.sample(&sample);
            if let Ok(contact) = contacts.observe(&sample) {
                monitor.contact(contact);
            }
        }
    };
    for message in &input.messages {
        monitor.message(message);
        sync.push(*message);
        take(&mut sync, &mut monitor);
    }
    sync.finish();
    take(&mut sync, &mut monitor);
    monitor.findings(&input.scan, &FaceTree::new(&input.scan))
}

impl Input {
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
        let faces: Vec<[u32; 3]> = self.scan.faces().map(|(_, corners)| corners.map(|corner| corner.0)).collect();
        let positions = self.scan.positions().iter().map(|p| change(*p)).collect();
        self.scan = TriMesh::new(positions, faces).unwrap();
        self
    }

    fn tip(mut self, change: impl Fn(&mut TipParams)) -> Self {
        change(&mut self.tip);
        self
    }

    fn late(self, ms: f64) -> Self {
        self.wrenches(|wrench| wrench.stamp_ns += (ms * 1e6) as i64)
    }
}

type Mistake = (&'static str, InputCause, fn(Input) -> Input);

fn wxyz(pose: &mut StampedPose) {
    let q = pose.pose_ot.rotation.coords;
    pose.pose_ot.rotation = UnitQuaternion::new_normalize(Quaternion::new(q.z, q.w, q.x, q.y));
}

const MISTAKES: &[Mistake] = &[
    ("wrench reversed", InputCause::WrenchSign, |x| x.forces(|f| -f)),
    ("wrench turned 90° about x", InputCause::WrenchFrame, |x| x.forces(|f| Vector3::new(f.x, -f.z, f.y))),
    ("wrench turned 90° about y", InputCause::WrenchFrame, |x| x.forces(|f| Vector3::new(f.z, f.y, -f.x))),
    ("wrench's axes in another order", InputCause::WrenchFrame, |x| x.forces(|f| Vector3::new(f.y, f.z, f.x))),
    ("quaternion w first", InputCause::QuaternionOrder, |x| x.poses(wxyz)),
    ("tare 2 N", InputCause::Tare, |x| x.forces(|f| f + Vector3::new(1.2, 0.0, -1.6))),
    ("tare 5 N", InputCause::Tare, |x| x.forces(|f| f + Vector3::new(0.0, 4.0, 3.0))),
    ("tare 10 N", InputCause::Tare, |x| x.forces(|f| f + Vector3::new(-6.0, 0.0, 8.0))),
    ("wrench 20 ms late", InputCause::Delay, |x| x.late(20.0)),
    ("wrench 40 ms late", InputCause::Delay, |x| x.late(40.0)),
    ("wrench 80 ms late", InputCause::Delay, |x| x.late(80.0)),
    ("wrench 100 ms late", InputCause::Delay, |x| x.late(100.0)),
    ("wrench 40 ms early", InputCause::Delay, |x| x.late(-40.0)),
    ("wrench 100 ms early", InputCause::Delay, |x| x.late(-100.0)),
    ("two epochs", InputCause::TwoEpochs, |x| x.wrenches(|w| w.stamp_ns -= 1_600_000_000_000_000_000)),
    ("stamps of poses zero", InputCause::ZeroStamps, |x| x.poses(|p| p.stamp_ns = 0)),
    ("stamps of wrenches zero", InputCause::ZeroStamps, |x| x.wrenches(|w| w.stamp_ns = 0)),
    ("scan in mm as inch", InputCause::LengthUnit, |x| x.scan(|p| p * 25.4)),
    ("scan in mm as m", InputCause::LengthUnit, |x| x.scan(|p| p * 1e3)),
    ("scan in m as mm", InputCause::LengthUnit, |x| x.scan(|p| p * 1e-3)),
    ("scan in inch as mm", InputCause::LengthUnit, |x| x.scan(|p| p / 25.4)),
    ("poses in mm", InputCause::LengthUnit, |x| x.positions(|p| p * 1e3)),
    ("tip in m", InputCause::Radius, |x| x.tip(|tip| tip.radius *= 1e-3)),
    ("radius times 4", InputCause::Radius, |x| x.tip(|tip| tip.radius *= 4.0)),
    ("force in gram", InputCause::ForceUnit, |x| x.forces(|f| f * 101.97)),
    ("force in kN", InputCause::ForceUnit, |x| x.forces(|f| f * 1e-3)),
    ("scan shifted 30 mm up", InputCause::Frame, |x| x.scan(|p| p + Vector3::z() * 30e-3)),
    ("scan shifted 30 mm aside", InputCause::Frame, |x| x.scan(|p| p + Vector3::x() * 30e-3)),
    ("scan turned 20°", InputCause::Frame, |x| {
        x.scan(|p| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 20f64.to_radians()) * p)
    }),
    ("flange in place of ball", InputCause::Frame, |x| {
        x.poses(|p| p.pose_ot *= Isometry3::from_parts(Translation3::new(0.0, 0.0, 0.15), UnitQuaternion::identity()))
    }),
    ("positions with y and z swapped", InputCause::PositionAxes, |x| x.positions(|p| Vector3::new(p.x, p.z, p.y))),
    ("saturated", InputCause::Saturation, |x| x.forces(|f| f.map(|x| x.clamp(-2.0, 2.0)))),
    ("poses at 20 Hz", InputCause::SlowPoses, |mut x| {
        let mut count = 0;
        x.messages.retain(|message| {
            count += usize::from(matches!(message, Message::Pose(_)));
            matches!(message, Message::Wrench(_)) || count % 25 == 0
        });
        x
    }),
    ("light touch", InputCause::LightTouch, |x| x.forces(|f| f * 0.08)),
];

/// Mistakes that are not the first and sure finding, of how many.
fn missed(seed: u64) -> (Vec<&'static str>, usize) {
    let sound = simulated(seed);
    assert_eq!(findings(&sound), [], "seed {seed}");
    let is_named = |cause: InputCause, found: &[InputFinding]| {
        found.first().is_some_and(|first| first.cause == cause && first.is_sure)
    };
    let missed = MISTAKES.iter().filter(|(_, cause, make)| !is_named(*cause, &findings(&make(sound.clone()))));
    (missed.map(|(what, ..)| *what).collect(), MISTAKES.len())
}

#[test]
fn sound_input_raises_no_alarm_and_each_mistake_is_named() {
    for seed in [3, 4] {
        assert_eq!(missed(seed).0, [""; 0], "seed {seed}");
    }
}

/// A ball as wide as the holes of the plate (seeds 2, 6, 10, …) rests on their rims: there neither its free motion nor its stop is clear.
#[test]
fn over_twenty_seeds_nine_of_ten_mistakes_are_named() {
    if !is_full() {
        return;
    }
    let (mut all, mut lost) = (0, 0);
    for seed in 1..=20 {
        let (missed, count) = missed(seed);
        println!("| {seed} | {} of {count} | {} |", count - missed.len(), missed.join(", "));
        (all, lost) = (all + count, lost + missed.len());
    }
    assert!(10 * lost <= all, "{lost} of {all}");
}
