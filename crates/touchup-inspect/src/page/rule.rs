//! The decision rule in words and formulas, and the symbols.

use maud::{Markup, html};
use touchup_geometry::numeric::normal_quantile;

use super::sections::rule_name;
use crate::words::percent;
use touchup_features::conformity::DecisionRule;
use touchup_features::features::InspectedQuantity;
use touchup_io::inspection_file::InspectionRecord;

/// p_c, the probability of conformity.
fn p_c() -> Markup {
    html! { "p" sub { "c" } }
}

/// The section.
pub(super) fn rule(record: &InspectionRecord) -> Markup {
    let is_zone = |quantity: &str| {
        InspectedQuantity::of_name(quantity).is_some_and(InspectedQuantity::is_zone)
    };
    let characteristics = &record.characteristics;
    html! {
        section {
            h2 { "Decision rule" }
            p { strong { (rule_name(record)) } }
            (limits_in_words(record))
            p {
                "The probability of conformity follows from the measured value y, its standard uncertainty u and the \
                tolerance limits (JCGM 106:2012, 7):"
            }
            p.formula { (p_c()) " = Φ((T" sub { "U" } " − y) / u) − Φ((T" sub { "L" } " − y) / u)" }
            @if characteristics.iter().any(|one| is_zone(&one.quantity)) {
                p {
                    "A width of a zone cannot be below 0: its distribution is the normal one without what is below 0. \
                    Of a position the place of the centre is distributed round and normal about the measured one, \
                    and " (p_c()) " is what of that is in the zone."
                }
            }
            @if characteristics.iter().any(|one| one.is_at_least) {
                p {
                    "A lower bound (≥) fails beyond the upper limit; else it stays undecided, unless there is a lower \
                    limit alone."
                }
            }
            p {
                "A pass is wrong with the probability 1 − " (p_c()) ", a fail with " (p_c()) ". Nothing is decided on a \
                value without an uncertainty: one that was fitted to the mesh alone."
            }
            h3 { "Symbols" }
            (symbols(record.coverage_factor))
        }
    }
}

fn limits_in_words(record: &InspectionRecord) -> Markup {
    if record.rule == DecisionRule::Simple.name() {
        return html! {
            p {
                "Simple acceptance: a characteristic passes where its measured value is within the tolerance limits, and \
                fails where it is not. There are no guard bands, so the risk of a wrong decision is up to 50 %, and is \
                shared by supplier and customer; it stands with each decision."
            }
        };
    }
    let (p, z) = (
        percent(record.confidence),
        normal_quantile(record.confidence),
    );
    html! {
        p {
            "ISO 14253-1: conformity has to be proved for a pass, nonconformity for a fail, each with a probability of at \
            least " (p) " %. A characteristic passes in the acceptance zone, where " (p_c()) " ≥ " (p) " %: the tolerance \
            zone less a guard band g at each limit. It fails outside of the tolerance zone enlarged by g. Between them \
            nothing is proved, and it is undecided."
        }
        p.formula { "g = z u,\u{2002} Φ(z) = " (p) " %,\u{2002} z = " (format!("{z:.3}")) }
        p {
            "Where u is not small against the tolerance, the guard bands inside of it are wider, so that " (p_c()) " = "
            (p) " % on the acceptance limits (JCGM 106:2012, 8.3)."
        }
    }
}

fn symbols(k: f64) -> Markup {
    html! {
        dl.glossary.small {
            dt { "y" } dd { "measured value (actual)" }
            dt { "u" } dd { "standard uncertainty of y" }
            dt { "U = k u" } dd { "expanded uncertainty, k = " (k) " is the coverage factor" }
            dt { "T" sub { "L" } ", T" sub { "U" } } dd { "lower and upper tolerance limit" }
            dt { "g" } dd { "guard band" }
            dt { (p_c()) } dd { "probability that the characteristic conforms" }
            dt { "Φ" } dd { "distribution function of the standard normal distribution" }
        }
    }
}
