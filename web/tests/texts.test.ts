/** Every text is there in every language, the page uses it, and no words of the page go around the table. */
import { readdirSync, readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import { LANGUAGES, texts } from "../src/texts";

const SOURCES = new URL("../src/", import.meta.url);
const sources = readdirSync(SOURCES)
  .filter((name) => name.endsWith(".ts") && !name.startsWith("texts"))
  .map((name) => ({ name, text: readFileSync(new URL(name, SOURCES), "utf8") }));

const placeholders = (text: string): string[] => [...text.matchAll(/\{(\w+)\}/g)].map((match) => match[1]).sort();

describe("the table of texts", () => {
  it.each(Object.entries(texts))("has %s in all languages, with the same values", (_, row) => {
    expect(row.length).toBe(LANGUAGES.length);
    for (const text of row) {
      expect(text.trim()).not.toBe("");
      expect(placeholders(text)).toEqual(placeholders(row[0]));
    }
  });

  it("has nothing that nobody shows", () => {
    const all = sources.map(({ text }) => text).join("\n");
    expect(Object.keys(texts).filter((key) => !all.includes(`"${key}"`))).toEqual([]);
  });
});

/** String literals of a source without comments, imports, errors for the log, and shaders. */
function literals(source: string): string[] {
  const code = source
    .replace(/\/\* glsl \*\/ `[^`]*`/g, "")
    .replace(/\/\*[\s\S]*?\*\//g, "")
    .replace(/^\s*(import|export) .* from .*$/gm, "")
    .replace(/(^|\s)\/\/ .*$/gm, "")
    .replace(/new (CdrError|GapError|Error)\(.*\)/g, "")
    .replace(/console\.\w+\(.*\)/g, "");
  return [...code.matchAll(/"((?:[^"\\\n]|\\.)*)"|`([^`]*)`/g)].map(([, plain, template]) =>
    (plain ?? template).replace(/\$\{(?:[^{}]|\{[^{}]*\})*\}/g, ""),
  );
}

/** Words that a reader would see: a capital at the beginning of a word, or letters beyond English. */
function looksLikeWords(literal: string): boolean {
  return /[äöüßñáéíóúÄÖÜ¿¡]/.test(literal) || /(^|[^\w-])[A-Z][a-z]+( |$)/.test(literal);
}

/** Literals with a capital that are no text: names of keys, before any choice of a language. */
const NAMES = new Set(["Enter", "Escape"]);

describe("the code", () => {
  it.each(sources)("$name shows no words but those of the table", ({ text }) => {
    expect(literals(text).filter((literal) => looksLikeWords(literal) && !NAMES.has(literal))).toEqual([]);
  });

  it.each(sources)("$name sets no text but by key or from numbers", ({ text }) => {
    expect(text).not.toMatch(/(textContent|innerText|title|placeholder|innerHTML) = ["'`][A-Za-z]/);
    expect(text).not.toMatch(/innerHTML|outerHTML|insertAdjacentHTML|eval\(|new Function/);
  });
});
