//! The motion of the arm, by its own clock: one line for each period, and the events between.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use super::body::Body;

/// Record whose lines are readable once their period has passed.
pub struct Record {
    out: Option<File>,
    event: String,
}

impl Record {
    pub fn new(path: Option<&Path>) -> std::io::Result<Self> {
        let mut out = path.map(File::create).transpose()?;
        if let Some(out) = &mut out {
            writeln!(
                out,
                "time_s,x_m,y_m,z_m,speed_m_per_s,turn_rad_per_s,force_n,event"
            )?;
        }
        Ok(Self {
            out,
            event: String::new(),
        })
    }

    /// Goes into the next line.
    pub fn event(&mut self, event: &str) {
        self.event += if self.event.is_empty() { "" } else { "; " };
        self.event += &event.replace(',', " ");
    }

    pub fn line(&mut self, body: &Body) {
        let event = std::mem::take(&mut self.event);
        let Some(out) = &mut self.out else { return };
        let ([linear, angular], place) = (body.velocity(), body.place());
        let (speed, turn, force, time) =
            (linear.norm(), angular.norm(), body.true_force(), body.time);
        let line = format!(
            "{time:.4},{:.7},{:.7},{:.7},{speed:.7},{turn:.7},{force:.3},{event}\n",
            place.x, place.y, place.z
        );
        // an unwritable record ends its reader's run by the deadline
        let _ = out.write_all(line.as_bytes());
    }
}
