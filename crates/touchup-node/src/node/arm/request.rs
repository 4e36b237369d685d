//! Content of a request, within the configured limits.

use crate::ros::messages::{ProbeResult, ProbeSettings};
use touchup_features::features::FeatureKind;
use touchup_probing::arm::{CRAWL, RequestLimits, TouchParams};
use touchup_probing::execute::ProbeParams;
use touchup_probing::plan::{FeatureQuantity, sigma_of};

/// Settings of a probing.
pub struct RequestSettings {
    /// configured parameters, narrowed
    pub params: ProbeParams,
    /// only plan
    pub is_dry_run: bool,
}

/// Confidence of a tolerance without one.
const CONFIDENCE: f64 = 0.95;

impl RequestSettings {
    /// Reads settings; 0 means as configured.
    ///
    /// # Errors
    /// A code of [`ProbeResult`] and the reason.
    pub fn of(
        settings: &ProbeSettings,
        configured: &ProbeParams,
        kind: Option<FeatureKind>,
    ) -> Result<Self, (u8, String)> {
        let bad = |why: String| (ProbeResult::BAD_REQUEST, why);
        let by = RequestLimits {
            force: some(settings.max_force),
            search: some(settings.max_search_travel),
            time: some(settings.max_duration),
            speed: None,
        };
        let mut params = configured
            .narrowed(&by)
            .map_err(|why| bad(why.to_string()))?;
        narrow_speeds(&mut params.touch, settings).map_err(bad)?;
        params.pattern.quantity = quantity_of(settings).map_err(bad)?;
        if !params.pattern.quantity.is_of(kind) {
            let kind = kind.map_or("unknown region", FeatureKind::name);
            return Err(bad(format!(
                "a {kind} has no {}",
                params.pattern.quantity.name()
            )));
        }
        match settings.pattern {
            ProbeSettings::PATTERN_TOUCHES => {}
            ProbeSettings::PATTERN_SLIDE => params.slides = true,
            other => return Err(bad(format!("there is no pattern {other}"))),
        }
        params.pattern.sigma = sigma(settings, params.pattern.sigma).map_err(bad)?;
        if settings.max_touches != 0 {
            let (asked, most) = (settings.max_touches as usize, params.pattern.budget);
            if asked > most {
                return Err(bad(format!(
                    "max_touches of {asked}: it may be up to the configured {most}"
                )));
            }
            params.pattern.budget = asked;
        }
        Ok(Self {
            params,
            is_dry_run: settings.dry_run,
        })
    }
}

/// A requested number; 0 requests none.
fn some(asked: f64) -> Option<f64> {
    (asked != 0.0).then_some(asked)
}

/// Narrows the speeds of a touch.
fn narrow_speeds(touch: &mut TouchParams, settings: &ProbeSettings) -> Result<(), String> {
    let (search, link) = (settings.max_search_speed, settings.max_link_speed);
    for (what, asked, speed) in [
        ("max_search_speed", search, &mut touch.search_speed),
        ("max_link_speed", link, &mut touch.link_speed),
    ] {
        match some(asked) {
            None => {}
            Some(asked) if asked >= CRAWL && asked <= *speed => *speed = asked,
            Some(asked) => {
                let range = format!("from {CRAWL} m/s to the configured {speed} m/s");
                return Err(format!("{what} of {asked} m/s: it may be {range}"));
            }
        }
    }
    Ok(())
}

fn quantity_of(settings: &ProbeSettings) -> Result<FeatureQuantity, String> {
    Ok(match settings.quantity {
        ProbeSettings::QUANTITY_ALL => FeatureQuantity::All,
        ProbeSettings::QUANTITY_POSITION => FeatureQuantity::Position,
        ProbeSettings::QUANTITY_AXIS => FeatureQuantity::Axis,
        ProbeSettings::QUANTITY_DIAMETER => FeatureQuantity::Diameter,
        ProbeSettings::QUANTITY_LENGTH => FeatureQuantity::Length,
        ProbeSettings::QUANTITY_WIDTH => FeatureQuantity::Width,
        other => return Err(format!("touches cannot be chosen for quantity {other}")),
    })
}

/// Requested standard deviation, m or rad.
fn sigma(settings: &ProbeSettings, configured: f64) -> Result<f64, String> {
    let confidence = if settings.confidence == 0.0 {
        CONFIDENCE
    } else {
        settings.confidence
    };
    match (settings.tolerance, confidence) {
        (_, p) if !(p > 0.0 && p < 1.0) => {
            Err(format!("confidence is {p}: it must be above 0 and below 1"))
        }
        (0.0, _) if settings.quantity == ProbeSettings::QUANTITY_AXIS => {
            Err("an axis needs a tolerance of its own, rad".to_owned())
        }
        (0.0, _) => Ok(configured),
        (tolerance, p) if tolerance > 0.0 && tolerance.is_finite() => Ok(sigma_of(tolerance, p)),
        (tolerance, _) => Err(format!("tolerance is {tolerance}: it must be above 0")),
    }
}
