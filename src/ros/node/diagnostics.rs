//! How the node says how it is: in words, and in numbers once a second.

use std::sync::atomic::Ordering;
use std::time::Duration;

use tracing::{info, warn};

use super::channels::ViewInput;
use super::convert::header;
use super::error::NodeError;
use super::refinement::RefinementWorker;
use super::session::{NodeEnd, SessionReport};
use crate::live::Quantiles;
use crate::ros::messages::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::session::Unrecorded;

impl RefinementWorker {
    /// Looks whether the streams come; says so when that changed.
    pub(super) fn watch_streams(&mut self) {
        let (level, words) = self.state();
        // ages in it grow: what is said once is said until something else is
        let name = words.split(':').next().unwrap_or_default().to_owned();
        if name != self.last_state {
            match level {
                DiagnosticStatus::OK => info!("{words}"),
                _ => warn!("{words}"),
            }
            self.last_state = name;
        }
    }

    /// What a state means to who watches: a level of [`DiagnosticStatus`], and in words.
    fn state(&mut self) -> (u8, String) {
        let now = self.setup.clock.now();
        let stale = Duration::from_secs_f64(self.setup.shared.parameters().double("stale_ms") / 1e3);
        let is_stale = self.streams.each_mut().map(|stream| stream.check(now, stale));
        if let Some(fault) = &self.fault {
            return (DiagnosticStatus::ERROR, format!("stopped: {fault}"));
        }
        if let Unrecorded { reason: Some(reason), is_refused: true, .. } = self.session.recorder.unrecorded() {
            let words = format!("does not record, make room on the disk and it goes on: {reason}");
            return (DiagnosticStatus::ERROR, words);
        }
        if self.stops.is_paused() {
            return (DiagnosticStatus::OK, "paused: samples are passed over".to_owned());
        }
        if let Some((_, why)) =
            self.lost_transform.as_ref().filter(|(at, _)| now.saturating_duration_since(*at) < stale)
        {
            return (DiagnosticStatus::WARN, format!("holds, frames are not connected: {why}"));
        }
        if self.streams.iter().all(|stream| stream.arrived == 0) {
            return (DiagnosticStatus::STALE, "waits: neither pose nor wrench has come yet".to_owned());
        }
        let late = ["pose", "wrench"].iter().zip(&self.streams).zip(is_stale).filter(|(_, late)| *late);
        let ages = late.map(|((name, stream), _)| match stream.age(now) {
            Some(age) => format!("the last {name} came {} ms ago", age.as_millis()),
            None => format!("no {name} has come yet"),
        });
        let ages: Vec<_> = ages.collect();
        match ages.is_empty() {
            false => (DiagnosticStatus::WARN, format!("holds, a stream is stale: {}", ages.join(", "))),
            true => (DiagnosticStatus::OK, "runs: samples are taken".to_owned()),
        }
    }

    /// What the session says of itself so far.
    pub(super) fn report(&self) -> SessionReport {
        self.session.report(&self.setup, &*self.port, self.streams.each_ref().map(|stream| stream.gaps))
    }

    pub(super) fn publish_diagnostics(&mut self) {
        let (level, words) = self.state();
        let report = self.report();
        let status = |name: &str, message: String, values| DiagnosticStatus {
            level,
            name: format!("touchup: {name}"),
            message,
            hardware_id: self.setup.source.to_owned(),
            values,
        };
        let how = "how poses and wrenches come, and what was refused".to_owned();
        let status =
            vec![status("session", words, self.numbers(&report)), status("streams", how, self.stream_numbers(&report))];
        let message = DiagnosticArray { header: header(self.port.now_ns(), ""), status };
        self.setup.shared.offer(&self.view, ViewInput::Diagnostics(Box::new(message)));
    }

    fn numbers(&self, report: &SessionReport) -> Vec<KeyValue> {
        let us = |ns: u64| format!("{:.1}", ns as f64 * 1e-3);
        let unrecorded = self.session.recorder.unrecorded();
        let shared = &self.setup.shared;
        let mut values = vec![
            value("session", &report.session),
            value("mesh_version", self.session.version),
            value("accepted", report.accepted),
            value("contacts", report.contacts),
        ];
        for (name, Quantiles { median, p99, max, .. }) in [("push", report.push_ns), ("latency", report.latency_ns)] {
            let quantiles = [("p50", median), ("p99", p99), ("max", max)];
            values.extend(quantiles.map(|(which, ns)| value(&format!("{name}_{which}_us"), us(ns))));
        }
        values.extend([
            value("late_renewals", report.late_renewals),
            value("tiles_waiting", shared.tiles_waiting.load(Ordering::Relaxed)),
            value("versions_behind", self.session.version.saturating_sub(shared.mesh.version())),
            value("dropped_view_frames", report.dropped_view_frames),
            value("unrecorded", unrecorded.messages),
        ]);
        values.extend(unrecorded.reason.map(|reason| value("recording", reason)));
        values
    }

    fn stream_numbers(&self, report: &SessionReport) -> Vec<KeyValue> {
        let now = self.setup.clock.now();
        let mut values = Vec::new();
        for (name, stream) in ["pose", "wrench"].iter().zip(&self.streams) {
            let age = stream.age(now).map_or_else(|| "none came".to_owned(), |age| age.as_millis().to_string());
            values.extend([
                value(&format!("{name}_rate_hz"), format!("{:.1}", stream.rate_hz)),
                value(&format!("{name}_age_ms"), age),
                value(&format!("{name}_gaps"), stream.gaps),
            ]);
        }
        let ([wrenches, poses], [dropped, others], [tiles, unsent]) = (report.lost, report.dropped, report.unsent);
        let counts = [
            ("lost_poses", poses),
            ("lost_wrenches", wrenches),
            ("dropped", dropped),
            ("dropped_others", others),
            ("unsent_tiles", tiles),
            ("unsent", unsent),
            ("paused", report.paused),
            ("clock_jumps", report.clock_jumps),
        ];
        values.extend(counts.map(|(name, count)| value(name, count)));
        values.extend(report.refused.iter().map(|(reason, count)| value(&format!("refused_{reason}"), count)));
        values.extend(self.endpoints.values().map(|endpoint| {
            let why = endpoint.mismatch.as_ref().map_or(String::new(), |why| format!(", {why}"));
            value(&format!("on {}", endpoint.topic), format!("{}{why}", endpoint.count))
        }));
        values
    }

    /// Ends the session and what still ends of those before.
    pub(super) fn end(mut self) -> Result<NodeEnd, NodeError> {
        self.finish_samples();
        self.send_edits();
        let report = self.report();
        let folder = self.session.folder.path().to_owned();
        let Self { setup, session, side_work, .. } = self;
        side_work.finish();
        Ok(NodeEnd { folder, report: session.end(&setup, report)? })
    }
}

fn value(key: &str, value: impl ToString) -> KeyValue {
    KeyValue { key: key.to_owned(), value: value.to_string() }
}
