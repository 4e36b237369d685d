//! State of the node: in words, and in numbers once a second.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use tracing::{info, warn};

use super::error::NodeError;
use super::input::acceptance::{SampleVerdict, is_of_pairing, meaning};
use super::refinement::RefinementWorker;
use super::session::{NodeEnd, SessionReport};
use crate::ros::convert::header;
use crate::ros::messages::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::ros::port::{Endpoint, Publication};
use touchup_session::live::{Latencies, Quantiles};

/// State before the first verdict on the samples.
const BEGINS: &str = "begins";
/// Offset between the streams' stamps that means unsynchronised clocks, s: no sensor is that slow.
const CLOCKS_APART: f64 = 1.0;
/// Minimum offset named as the cause if nothing pairs, s.
const NAMED_APART: f64 = 0.1;

impl RefinementWorker {
    /// Checks the streams; logs a changed state.
    pub(super) fn watch_streams(&mut self) {
        let (level, words) = self.state();
        // ages in it grow: only a new state is logged
        let name = words.split(':').next().unwrap_or_default().to_owned();
        if name != self.last_state {
            let now = self.setup.clock.now();
            let since_s = now
                .saturating_duration_since(self.state_since)
                .as_secs_f64();
            match level {
                // readers of a warning also see its end
                DiagnosticStatus::OK if self.last_state.starts_with("holds") => {
                    warn!("{words}, again after {since_s:.1} s");
                }
                DiagnosticStatus::OK => info!("{words}"),
                // the first second is too short for a verdict
                _ if name == BEGINS => return,
                _ => warn!("{words}"),
            }
            (self.last_state, self.state_since) = (name, now);
        }
    }

    /// The state for an observer: a level of [`DiagnosticStatus`], and words.
    fn state(&mut self) -> (u8, String) {
        let now = self.setup.clock.now();
        let stale =
            Duration::from_secs_f64(self.setup.shared.parameters().double("stale_ms") / 1e3);
        let is_stale = self
            .streams
            .each_mut()
            .map(|stream| stream.check(now, stale));
        if let Some(words) = self.stopped() {
            return (DiagnosticStatus::ERROR, words);
        }
        if self.stops.is_paused() {
            self.acceptance.restart();
            let words = "paused: samples are passed over".to_owned();
            return (DiagnosticStatus::OK, words);
        }
        if let Some(state) = self.state_of_input(now, stale) {
            return state;
        }
        let late = ["pose", "wrench"]
            .iter()
            .zip(&self.streams)
            .zip(is_stale)
            .filter(|(_, late)| *late);
        let ages = late.map(|((name, stream), _)| match stream.age(now) {
            Some(age) => format!("the last {name} came {} ms ago", age.as_millis()),
            None => format!("no {name} has come yet"),
        });
        let ages: Vec<_> = ages.collect();
        if !ages.is_empty() {
            self.acceptance.restart();
            let words = format!("holds, a stream is stale: {}", ages.join(", "));
            return (DiagnosticStatus::WARN, words);
        }
        self.state_of_samples(now)
    }

    /// The fault that ended the refinement, or the disk that refuses its recording, in words.
    fn stopped(&self) -> Option<String> {
        if let Some(fault) = &self.fault {
            return Some(format!("stopped: {fault}"));
        }
        let loss = self.session.keeping.unrecorded();
        let reason = loss.reason.filter(|_| loss.is_refused)?;
        Some(format!(
            "does not record, make room on the disk and it goes on: {reason}"
        ))
    }

    /// State without connected frames or readable messages.
    fn state_of_input(&self, now: Instant, stale: Duration) -> Option<(u8, String)> {
        let warn = |words| Some((DiagnosticStatus::WARN, words));
        if let Some((_, why)) = self
            .lost_transform
            .as_ref()
            .filter(|(at, _)| now.saturating_duration_since(*at) < stale)
        {
            return warn(format!("holds, frames are not connected: {why}"));
        }
        if self.streams.iter().any(|stream| stream.arrived == 0)
            && self.session.counters.refused.contains_key("unreadable")
        {
            let why = meaning("unreadable");
            return warn(format!("waits, and something comes (unreadable): {why}"));
        }
        let unread = self.unread_topics();
        if !unread.is_empty() {
            let words = format!("cannot read what is published: {}", unread.join("; "));
            return Some((DiagnosticStatus::ERROR, words));
        }
        let missing = self
            .moving
            .as_ref()
            .filter(|_| self.streams[0].arrived == 0);
        if let Some(why) = missing.and_then(|moving| moving.missing(&self.resolver.frames)) {
            return warn(format!("waits, frames are not connected: {why}"));
        }
        let is_silent = self.streams.iter().all(|stream| stream.arrived == 0);
        let words = "waits: neither pose nor wrench has come yet";
        is_silent.then(|| (DiagnosticStatus::STALE, words.to_owned()))
    }

    /// Silent sensor topics despite a publisher, each with the reason.
    fn unread_topics(&self) -> Vec<String> {
        let [wrench, pose] = self.port.sample_topics();
        let silent = [(pose, 0), (wrench, 1)]
            .into_iter()
            .filter(|(_, stream)| self.streams[*stream].arrived == 0);
        let why = silent
            .filter_map(|(topic, _)| Some((topic, self.endpoints.get(topic)?.mismatch.as_ref()?)));
        why.map(|(topic, why)| format!("{topic}, {why}")).collect()
    }

    /// State of the samples while both streams come.
    fn state_of_samples(&mut self, now: Instant) -> (u8, String) {
        let verdict =
            self.acceptance
                .judge(now, self.session.counters.accepted, self.session.refused());
        let [poses, wrenches] = &self.streams;
        let beyond = poses.stamped_beyond(wrenches).unwrap_or(0.0);
        let which = if beyond < 0.0 { "behind" } else { "ahead of" };
        let apart = format!(
            "poses are stamped {:.2} s {which} the wrenches that come at the same time: set the clocks of both sources \
             alike",
            beyond.abs()
        );
        if let Some(words) = self.mixed() {
            return (DiagnosticStatus::WARN, words);
        }
        let named_apart = (beyond.abs() > NAMED_APART).then_some(&*apart);
        match verdict {
            SampleVerdict::Begins => (
                DiagnosticStatus::STALE,
                format!("{BEGINS}: poses and wrenches come, no sample yet"),
            ),
            SampleVerdict::Refuses { reason, count, of } => {
                let why = self.why_refused(&reason, named_apart);
                let words =
                    format!("refuses most of what comes ({reason}): {why}; {count} of {of} lately");
                (DiagnosticStatus::WARN, words)
            }
            SampleVerdict::PairsNone => {
                let why = named_apart.unwrap_or("no wrench is stamped between two poses");
                (
                    DiagnosticStatus::WARN,
                    format!("makes no samples though poses and wrenches come: {why}"),
                )
            }
            SampleVerdict::Accepts if beyond.abs() > CLOCKS_APART => (
                DiagnosticStatus::WARN,
                format!("pairs what was not measured together: {apart}"),
            ),
            SampleVerdict::Accepts if let Some(finding) = self.doubts.first() => {
                let level = if finding.is_sure {
                    DiagnosticStatus::ERROR
                } else {
                    DiagnosticStatus::WARN
                };
                (
                    level,
                    format!("doubts its input ({}): {finding}", finding.cause),
                )
            }
            SampleVerdict::Accepts => (DiagnosticStatus::OK, "runs: samples are taken".to_owned()),
        }
    }

    /// A sensor topic with several publishers, in words.
    fn mixed(&self) -> Option<String> {
        let Endpoint { topic, count, .. } = self
            .port
            .sample_topics()
            .into_iter()
            .filter_map(|topic| self.endpoints.get(topic))
            .find(|endpoint| endpoint.count > 1)?;
        Some(format!(
            "mixes samples (of {count} publishers on {topic}): all but one measure something else; \
             `ros2 topic info -v {topic}` has their nodes"
        ))
    }

    /// Cause of most refusals.
    ///
    /// - `apart`: offset between the stamps of both streams in words, if large.
    fn why_refused(&self, reason: &str, apart: Option<&str>) -> String {
        let [poses, wrenches] = &self.streams;
        let is_pairing = is_of_pairing(reason);
        let is_stamping = is_pairing || reason.ends_with("duplicate");
        match apart {
            _ if is_stamping && poses.is_unstamped() => unstamped("poses"),
            _ if is_stamping && wrenches.is_unstamped() => unstamped("wrenches"),
            Some(apart) if is_pairing => apart.to_owned(),
            _ => meaning(reason).to_owned(),
        }
    }

    /// Report of the session up to now.
    pub(super) fn report(&self) -> SessionReport {
        self.session.report(
            &self.setup,
            &*self.port,
            self.streams.each_ref().map(|stream| stream.gaps),
        )
    }

    pub(super) fn publish_diagnostics(&mut self) {
        let (level, words) = self.state();
        let report = self.report();
        let status = |name: &str, message: String, values| DiagnosticStatus {
            level,
            name: format!("{}: {name}", self.port.node_name().trim_start_matches('/')),
            message,
            hardware_id: format!("{} of {}", self.setup.source, self.port.node_name()),
            values,
        };
        let numbers = self.numbers(&report);
        self.session.behind_lately = Latencies::new();
        let how = "how poses and wrenches come, and what was refused".to_owned();
        let status = vec![
            status("session", words, numbers),
            status("streams", how, self.stream_numbers(&report)),
        ];
        let message = DiagnosticArray {
            header: header(self.port.now_ns(), ""),
            status,
        };
        self.port.publish(Publication::Diagnostics(message));
    }

    fn numbers(&self, report: &SessionReport) -> Vec<KeyValue> {
        let us = |ns: u64| format!("{:.1}", ns as f64 * 1e-3);
        let unrecorded = self.session.keeping.unrecorded();
        let shared = &self.setup.shared;
        let mut values = vec![
            value("session", &report.session),
            value("mesh_version", self.session.version),
            value("accepted", report.accepted),
            value("contacts", report.contacts),
        ];
        for (
            name,
            Quantiles {
                median, p99, max, ..
            },
        ) in [("push", report.push_ns), ("latency", report.latency_ns)]
        {
            let quantiles = [("p50", median), ("p99", p99), ("max", max)];
            values
                .extend(quantiles.map(|(which, ns)| value(&format!("{name}_{which}_us"), us(ns))));
        }
        let Quantiles {
            median, p99, max, ..
        } = self.session.behind_lately.quantiles();
        let behind = [("p50", median), ("p99", p99), ("max", max)];
        values.extend(behind.map(|(which, ns)| {
            value(
                &format!("patch_behind_{which}_ms"),
                format!("{:.1}", ns as f64 * 1e-6),
            )
        }));
        values.extend([
            value("renewals", report.renewals),
            value("late_renewals", report.late_renewals),
            value(
                "tiles_waiting",
                shared.tiles_waiting.load(Ordering::Relaxed),
            ),
            value(
                "versions_behind",
                self.session.version.saturating_sub(shared.mesh.version()),
            ),
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
            let age = stream
                .age(now)
                .map_or_else(|| "none came".to_owned(), |age| age.as_millis().to_string());
            values.extend([
                value(&format!("{name}_rate_hz"), format!("{:.1}", stream.rate_hz)),
                value(&format!("{name}_age_ms"), age),
                value(&format!("{name}_gaps"), stream.gaps),
            ]);
        }
        if let Some(moving) = &self.moving {
            values.push(value("poses_interpolated", moving.interpolated));
            values.push(value("transforms_outside", moving.outside));
        }
        let ([wrenches, poses], [dropped, others], [tiles, unsent]) =
            (report.lost, report.dropped, report.unsent);
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
        values.extend(
            report
                .refused
                .iter()
                .map(|(reason, count)| value(&format!("refused_{reason}"), count)),
        );
        values.extend(self.endpoints.values().map(|endpoint| {
            let why = endpoint
                .mismatch
                .as_ref()
                .map_or(String::new(), |why| format!(", {why}"));
            value(
                &format!("on {}", endpoint.topic),
                format!("{}{why}", endpoint.count),
            )
        }));
        values
    }

    /// Ends the session and finishes the earlier ones.
    pub(super) fn end(mut self) -> Result<NodeEnd, NodeError> {
        self.finish_samples();
        self.send_edits();
        let report = self.report();
        let folder = self.session.folder.path().to_owned();
        let Self {
            setup,
            session,
            side_work,
            uncertainty,
            ..
        } = self;
        side_work.finish();
        uncertainty.threads.finish();
        Ok(NodeEnd {
            folder,
            report: session.end(&setup, report)?,
        })
    }
}

fn unstamped(which: &str) -> String {
    format!("{which} are not stamped: fill header.stamp at the source")
}

fn value(key: &str, value: impl ToString) -> KeyValue {
    KeyValue {
        key: key.to_owned(),
        value: value.to_string(),
    }
}
