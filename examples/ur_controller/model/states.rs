//! All outputs of the controller, at one moment.

use nalgebra::Vector3;

use super::controller::{Controller, Safety};

#[derive(Clone)]
pub struct States {
    pub time: f64,
    pub q: [f64; 6],
    pub pose: [f64; 6],
    pub speed: [f64; 6],
    pub force: [f64; 6],
    pub raw: [f64; 6],
    pub safety_bits: u32,
    /// of the speed slider, 0 to 1
    pub speed_fraction: f64,
    pub is_playing: bool,
    pub is_paused: bool,
    pub ints: [i32; 48],
    pub doubles: [f64; 48],
}

impl States {
    pub fn read(controller: &mut Controller) -> Self {
        let pose = controller.body.read_pose();
        let (place, turn) = (pose.translation.vector, pose.rotation.scaled_axis());
        let ([linear, angular], (force, [raw, torque])) =
            (controller.body.velocity(), controller.body.read_wrenches());
        let six = |a: Vector3<f64>, b: Vector3<f64>| [a.x, a.y, a.z, b.x, b.y, b.z];
        let safety_bits = match controller.safety {
            Safety::Normal => 1,
            Safety::Protective => 1 << 2 | 1 << 10,
            Safety::Safeguard => 1 << 4 | 1 << 10,
            Safety::Emergency => 1 << 6 | 1 << 7 | 1 << 10,
        };
        Self {
            time: controller.body.time,
            q: std::array::from_fn(|joint| controller.body.joints[joint]),
            pose: six(place, turn),
            speed: six(linear, angular),
            force: six(force, Vector3::zeros()),
            raw: six(raw, torque),
            safety_bits: if controller.is_reduced {
                safety_bits & !1 | 1 << 1
            } else {
                safety_bits
            },
            speed_fraction: controller.body.slider,
            is_playing: controller.is_playing(),
            is_paused: controller.is_paused(),
            ints: controller.ints_out,
            doubles: controller.doubles_out,
        }
    }
}
