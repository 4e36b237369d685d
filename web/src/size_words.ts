/** How large a part is, as things that everybody has had in a hand: a wrong unit (inch, m) is off by 25 or 1000 and shows at once. */
import type { TextKey } from "./texts";

/** Longest side up to which a part is about as large as the thing, m. */
const THINGS: Array<[number, TextKey]> = [
  [0.004, "thingRice"],
  [0.015, "thingPea"],
  [0.035, "thingCoin"],
  [0.065, "thingMatchbox"],
  [0.11, "thingCard"],
  [0.2, "thingPhone"],
  [0.35, "thingSheet"],
  [0.8, "thingSuitcase"],
  [1.5, "thingDoor"],
  [6, "thingCar"],
];

export function likeWhat(longest: number): TextKey {
  return THINGS.find(([up]) => longest <= up)?.[1] ?? "thingHouse";
}
