/**
 * The page's own pictures: outlines on a square of 24, drawn with a line of width 2.
 */
export const ICONS = {
  undo: "M9 6 4 11l5 5M4 11h10a6 6 0 0 1 6 6v1",
  redo: "M15 6l5 5-5 5M20 11H10a6 6 0 0 0-6 6v1",
  pause: "M8 5v14M16 5v14",
  play: "M7 5l12 7-12 7z",
  save: "M12 4v11M7 11l5 5 5-5M4 20h16",
  fresh: "M12 5v14M5 12h14",
  sessions: "M4 6h6l2 3h8v10H4z",
  menu: "M5 7h14M5 12h14M5 17h14",
  check: "M5 4h14v16H5zM8 12l3 3 5-6",
  share: "M12 15V4M8 8l4-4 4 4M5 12v8h14v-8",
  close: "M6 6l12 12M18 6 6 18",
  whole: "M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5",
  top: "M4 10l8-5 8 5-8 5zM4 10v5l8 5 8-5v-5",
  front: "M5 6h14v12H5z",
  side: "M7 5h7l4 3v11h-7l-4-3zM14 5v0M11 19V8h7M7 5l4 3",
  follow: "M12 3v4M12 17v4M3 12h4M17 12h4M12 9a3 3 0 1 0 0 6 3 3 0 0 0 0-6",
  measure: "M3 15 15 3l6 6L9 21zM7 11l2 2M11 7l2 2",
  accept: "M5 13l4 4L19 7",
  reject: "M7 7l10 10M17 7 7 17",
  lock: "M6 11h12v9H6zM9 11V7a3 3 0 0 1 6 0v4",
  back: "M15 5l-7 7 7 7",
  stop: "M7 7h10v10H7z",
  search: "M10.5 4a6.5 6.5 0 1 0 0 13 6.5 6.5 0 0 0 0-13M15.5 15.5 20 20",
  takeOut: "M4 8c3-4 6 4 9 0M4 18h9M16 10l5 5M21 10l-5 5",
  report: "M6 3h9l4 4v14H6zM9 12h7M9 16h7M14 3v5h5",
  sheet: "M7 14l5-5 5 5",
} as const;

export type IconName = keyof typeof ICONS;
