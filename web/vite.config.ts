// Build of the page: one script, one style sheet, no inlined data, so that a strict Content-Security-Policy can hold.
import { defineConfig } from "vite";

/** Where `npm run dev` finds a node. */
const NODE = "http://127.0.0.1:8321";

export default defineConfig({
  base: "/",
  build: {
    target: "es2022",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1000,
  },
  server: {
    host: "127.0.0.1",
    proxy: {
      // the node checks both names
      "/ws": { target: NODE, ws: true, changeOrigin: true, headers: { origin: NODE } },
      "/api": { target: NODE, changeOrigin: true, headers: { origin: NODE } },
    },
  },
});
