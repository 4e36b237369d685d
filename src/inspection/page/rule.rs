//! The decision rule in words and formulas, and the symbols.

use super::sections::rule_name;
use crate::conformity::DecisionRule;
use crate::features::InspectedQuantity;
use crate::inspection::words::percent;
use crate::io::inspection_file::InspectionRecord;
use touchup_core::numeric::normal_quantile;

pub(super) fn rule(record: &InspectionRecord) -> String {
    let (p, k) = (percent(record.confidence), record.coverage_factor);
    let z = normal_quantile(record.confidence);
    let is_simple = record.rule == DecisionRule::Simple.name();
    let words = if is_simple {
        "<p>Simple acceptance: a characteristic passes where its measured value is within the tolerance limits, and fails where it is not. There are \
         no guard bands, so the risk of a wrong decision is up to 50 %, and is shared by supplier and customer; it stands with each decision.</p>"
            .to_owned()
    } else {
        format!(
            "<p>ISO 14253-1: conformity has to be proved for a pass, nonconformity for a fail, each with a probability of at least {p} %. A characteristic passes \
             in the acceptance zone, where p<sub>c</sub> ≥ {p} %: the tolerance zone less a guard band g at each limit. It fails outside of the tolerance zone \
             enlarged by g. Between them nothing is proved, and it is undecided.</p>\n\
             <p class=\"formula\">g = z u,&ensp; Φ(z) = {p} %,&ensp; z = {z:.3}</p>\n\
             <p>Where u is not small against the tolerance, the guard bands inside of it are wider, so that p<sub>c</sub> = {p} % on the acceptance limits \
             (JCGM 106:2012, 8.3).</p>"
        )
    };
    let is_there = |is_of: fn(InspectedQuantity) -> bool| {
        record
            .characteristics
            .iter()
            .any(|one| InspectedQuantity::of_name(&one.quantity).is_some_and(is_of))
    };
    let mut more = String::new();
    if is_there(InspectedQuantity::is_zone) {
        more += "<p>A width of a zone cannot be below 0: its distribution is the normal one without what is below 0. Of a position the place of the centre is \
                 distributed round and normal about the measured one, and p<sub>c</sub> is what of that is in the zone.</p>\n";
    }
    if record.characteristics.iter().any(|one| one.is_at_least) {
        more += "<p>A lower bound (≥) fails beyond the upper limit; else it stays undecided, unless there is a lower limit alone.</p>\n";
    }
    format!(
        "<section><h2>Decision rule</h2>\n<p><strong>{}</strong></p>\n{words}\n\
         <p>The probability of conformity follows from the measured value y, its standard uncertainty u and the tolerance limits (JCGM 106:2012, 7):</p>\n\
         <p class=\"formula\">p<sub>c</sub> = Φ((T<sub>U</sub> − y) / u) − Φ((T<sub>L</sub> − y) / u)</p>\n{more}\
         <p>A pass is wrong with the probability 1 − p<sub>c</sub>, a fail with p<sub>c</sub>. Nothing is decided on a value without an uncertainty: one that \
         was fitted to the mesh alone.</p>\n\
         <h3>Symbols</h3>\n<dl class=\"glossary small\">\
         <dt>y</dt><dd>measured value (actual)</dd><dt>u</dt><dd>standard uncertainty of y</dd><dt>U = k u</dt><dd>expanded uncertainty, k = {k} is the coverage factor</dd>\
         <dt>T<sub>L</sub>, T<sub>U</sub></dt><dd>lower and upper tolerance limit</dd><dt>g</dt><dd>guard band</dd><dt>p<sub>c</sub></dt><dd>probability that the characteristic conforms</dd>\
         <dt>Φ</dt><dd>distribution function of the standard normal distribution</dd></dl></section>\n",
        rule_name(record),
    )
}
