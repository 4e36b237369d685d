/**
 * Meaning of the mesh colours: categories (support of a place) and scales (size of a number), for shader and legend.
 *
 * Categories are from the palette of Okabe and Ito; the scales grow in lightness, or from a light middle to two dark ends, so that they
 * read without telling red from green.
 */
import { FAR, type MeshStore } from "./mesh_store";
import type { TextKey } from "./texts";

export type Rgb = readonly [number, number, number];

export interface Category {
  colour: string;
  text: TextKey;
}

export interface ColourMode {
  name: "support" | "uncertainty" | "deviation" | "outlier";
  text: TextKey;
  /** By number, as it is in the mesh; null: it is a scale. */
  categories: Category[] | null;
  /** Colours at equal distances from the least to the largest number. */
  scale: string[];
  /** From minus the largest to the largest; else from zero. */
  isSigned: boolean;
  isThere(store: MeshStore): boolean;
}

const SEQUENTIAL = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"];
const DIVERGING = ["#08306b", "#1f5fa8", "#5b9bd0", "#b3d2e8", "#f4f4f2", "#f3c9a5", "#e08f4f", "#b85a17", "#7a3200"];
/** Steps of every scale; the shader has an array of this length. */
export const SCALE_STEPS = SEQUENTIAL.length;
/** Colour of an unknown number. */
export const UNKNOWN_COLOUR = "#8d969e";

export const COLOUR_MODES: ColourMode[] = [
  {
    name: "support",
    text: "colourSupport",
    categories: [
      { colour: "#bfc6cc", text: "supportScan" },
      { colour: "#009e73", text: "supportTouched" },
      { colour: "#56b4e9", text: "supportGuessed" },
      { colour: "#e69f00", text: "supportUnreachable" },
    ],
    scale: [],
    isSigned: false,
    isThere: () => true,
  },
  {
    name: "uncertainty",
    text: "colourUncertainty",
    categories: null,
    scale: SEQUENTIAL,
    isSigned: false,
    isThere: () => true,
  },
  {
    name: "deviation",
    text: "colourDeviation",
    categories: null,
    scale: DIVERGING,
    isSigned: true,
    isThere: (store) => store.deviation !== null,
  },
  {
    name: "outlier",
    text: "colourOutlier",
    categories: [
      { colour: "#bfc6cc", text: "outlierNo" },
      { colour: "#d55e00", text: "outlierYes" },
    ],
    scale: [],
    isSigned: false,
    isThere: (store) => store.hasOutliers,
  },
];

export function modeNamed(name: string): ColourMode {
  return COLOUR_MODES.find((mode) => mode.name === name) ?? COLOUR_MODES[0];
}

/** "#rrggbb" as numbers from 0 to 1, as they are on the screen. */
export function rgb(hex: string): Rgb {
  const number = Number.parseInt(hex.slice(1), 16);
  return [(number >> 16) / 255, ((number >> 8) & 255) / 255, (number & 255) / 255];
}

/** The largest number of a mode's scale in the mesh as it is, rounded up to 1, 2 or 5 times a power of ten, m. */
export function scaleEnd(mode: ColourMode, store: MeshStore): number {
  let largest = 0;
  if (mode.name === "uncertainty") {
    for (let i = 0; i < store.variance.length; i++) if (store.variance[i] > largest) largest = store.variance[i];
    largest = Math.sqrt(largest);
  } else if (mode.name === "deviation" && store.deviation !== null) {
    for (const x of store.deviation) if (Math.abs(x) > largest && x < FAR) largest = Math.abs(x);
  }
  return roundedUp(largest);
}

/** 1, 2 or 5 times a power of ten, not below the number. */
export function roundedUp(number: number): number {
  if (!(number > 0)) return 1e-3;
  const power = 10 ** Math.floor(Math.log10(number));
  const step = [1, 2, 5, 10].find((step) => step * power >= number * (1 - 1e-6)) ?? 10;
  return step * power;
}
