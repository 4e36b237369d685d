//! Bar of a characteristic: tolerance zone, acceptance zone, measured value with its expanded
//! uncertainty.

use maud::{Markup, html};

use touchup_features::features::InspectedQuantity;
use touchup_io::inspection_file::CharacteristicRecord;

/// Width, pixels.
const WIDTH: f64 = 150.0;
const DARK: &str = "#1d2129";

/// The bar as SVG; empty without a limit.
pub(super) fn tolerance_bar(one: &CharacteristicRecord) -> Markup {
    let number = |name: &str| one.number(name);
    let (lower, upper, actual) = (
        number("lower_limit"),
        number("upper_limit"),
        number("actual"),
    );
    let spread = number("expanded_uncertainty").unwrap_or(0.0);
    // a single limit draws the zone as wide as the value's distance from the limit
    let reach = actual.zip(lower.or(upper)).map_or(1.0, |(y, limit)| {
        (y - limit).abs().max(2.0 * spread).max(1e-6) * 1.6
    });
    let is_zone = InspectedQuantity::of_name(&one.quantity).is_some_and(InspectedQuantity::is_zone);
    let low = match (lower, upper) {
        (None, None) => return Markup::default(),
        _ if is_zone => 0.0,
        (Some(lower), _) => lower,
        (None, Some(upper)) => upper - reach,
    };
    let high = upper
        .or(lower.map(|lower| lower + reach))
        .unwrap_or(low + reach);
    let margin = (high - low) * 0.35;
    let x = |value: f64| {
        ((value - low + margin) / (high - low + 2.0 * margin) * WIDTH).clamp(2.0, WIDTH - 2.0)
    };
    let rect = |from: f64, to: f64, [top, tall]: [f64; 2], fill: &str| {
        let [from, width] = [from, (to - from).max(0.0)].map(|x| format!("{x:.1}"));
        html! { rect x=(from) y=(top) width=(width) height=(tall) fill=(fill) {} }
    };
    let accepted = [number("acceptance_lower"), number("acceptance_upper")];
    html! {
        svg viewBox={ "0 0 " (WIDTH) " 22" } width=(WIDTH) height="22" role="img" aria-label="value in its tolerance" {
            (rect(2.0, WIDTH - 2.0, [10.0, 2.0], "#c9ced8"))
            (rect(x(low), x(high), [6.0, 10.0], "#d8dde6"))
            @if accepted != [None; 2] {
                (rect(x(accepted[0].unwrap_or(low)), x(accepted[1].unwrap_or(high)), [6.0, 10.0], "#7fb9ac"))
            }
            @for limit in [lower, upper].into_iter().flatten() {
                (rect(x(limit) - 0.75, x(limit) + 0.75, [2.0, 18.0], DARK))
            }
            @if let Some(y) = actual {
                (rect(x(y - spread), if one.is_at_least { WIDTH - 2.0 } else { x(y + spread) }, [10.25, 1.5], DARK))
                @if (low - margin..=high + margin).contains(&y) {
                    circle cx=(format!("{:.1}", x(y))) cy="11" r="3.2" fill=(DARK) {}
                } @else {
                    path d=(if y > high { "M148 11 l-7 -5 v10 z" } else { "M2 11 l7 -5 v10 z" }) fill="#b94a00" {}
                }
            }
        }
    }
}
