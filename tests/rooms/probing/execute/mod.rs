mod command;
mod displaced;
mod interrupted;
mod opened;
mod planning;
mod sliding;
mod uncertainty;
mod way_out;

use nalgebra::Point3;
use touchup::probing::arm::{Limits, TouchParams};
use touchup::probing::execute::{ProbeParams, RobotCell, Tool};
use touchup::probing::plan::PatternParams;
use touchup::sim::ArmParams;

fn cell() -> RobotCell {
    let ArmParams {
        geometry,
        pose_bo,
        pose_ft,
        ..
    } = ArmParams::default();
    RobotCell {
        geometry,
        pose_bo,
        pose_ft,
        tool: Tool::default(),
    }
}

fn params() -> ProbeParams {
    let limits = Limits {
        lowest: Point3::new(-0.6, -0.3, 0.0),
        highest: Point3::new(-0.2, 0.2, 0.4),
        ..Limits::default()
    };
    let pattern = PatternParams {
        sigma: 10e-6,
        touch_sigma: 5e-6,
        ..PatternParams::default()
    };
    ProbeParams {
        touch: TouchParams::default(),
        pattern,
        goals: Default::default(),
        slides: false,
        limits,
    }
}
