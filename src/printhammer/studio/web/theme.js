// Colours of M. Okabe and K. Ito (2008), which the colour-blind can tell apart, in light and in dark.
const NAMES = ["ink", "muted", "faint", "paper", "panel", "accent", "x", "drive", "pack", "backstop", "spring", "magnet", "damping", "drag", "total", "ghost", "overlay", "lost", "volts"];

let found = {};

/** Read the colours that the style sheet sets for an element. */
export function readColours(element) {
  const style = getComputedStyle(element);
  found = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  found.dark = style.getPropertyValue("--dark").trim() === "1";
}

export const colours = () => found;
export const FONT = '11px system-ui, "Segoe UI", Roboto, sans-serif';
export const SMALL = '10px system-ui, "Segoe UI", Roboto, sans-serif';
