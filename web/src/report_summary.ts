/** Result of an inspection: the verdict, each decision with sign and word, the worst first, and the files of the report. */
import { el } from "./dom";
import { type Characteristic, countWords, decisionWord, type Inspection, LEVELS, valueWords, worstFirst } from "./inspection";
import { locale, t } from "./language";

/** More of them are in the report alone. */
const MOST_SHOWN = 200;
const DOWNLOADS = ["results.csv", "results.json", "results.qif"];

export function reportAddress(session: string): string {
  return `/api/reports/${encodeURIComponent(session)}`;
}

export function fileAddress(session: string, file: string): string {
  return `/api/sessions/${encodeURIComponent(session)}/${encodeURIComponent(file)}`;
}

export function reportSummary(session: string, inspection: Inspection): HTMLElement {
  const when = new Intl.DateTimeFormat(locale(), { dateStyle: "medium", timeStyle: "short" }).format(new Date(inspection.date));
  const verdict = el(
    "p",
    { class: "verdict" },
    pill(inspection.verdict),
    el("strong", {}, countWords(inspection)),
    el("span", { class: "muted" }, when),
  );
  const open = el("a", { class: "button primary", attributes: { href: reportAddress(session), target: "_blank", rel: "noopener" } }, t("reportOpen"));
  const downloads = DOWNLOADS.map((file) => el("a", { attributes: { href: fileAddress(session, file), download: file } }, file.split(".")[1].toUpperCase()));
  const rows = worstFirst(inspection.characteristics);
  const more = rows.length > MOST_SHOWN ? el("p", { class: "muted" }, t("reportMore", { count: rows.length - MOST_SHOWN })) : null;
  return el(
    "section",
    { class: "report-summary", attributes: { "aria-label": t("reportResult") } },
    verdict,
    el("div", { class: "row start" }, open, ...downloads),
    el("ol", { class: "decisions" }, ...rows.slice(0, MOST_SHOWN).map(row)),
    more,
    ...inspection.notes.map((note) => el("p", { class: "muted" }, note)),
  );
}

function pill(decision: Inspection["verdict"]): HTMLElement {
  return el("span", { class: "pill", attributes: { "data-level": LEVELS[decision] } }, decisionWord(decision));
}

function row(one: Characteristic): HTMLElement {
  const reason = one.reason === undefined ? null : el("span", { class: "muted" }, one.reason);
  return el(
    "li",
    {},
    pill(one.decision),
    el("strong", {}, `${one.number} ${one.name}`),
    el("span", { class: "value" }, valueWords(one)),
    reason,
  );
}
