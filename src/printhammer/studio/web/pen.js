// A pen draws on a canvas, or writes SVG: both understand the same few commands.

/** Writes as SVG what is drawn with the commands of a canvas that the views use. */
export class SvgPen {
  constructor(width, height, title = "") {
    Object.assign(this, {
      width, height, parts: title ? [`<title>${escape(title)}</title>`] : [], path: "", fillStyle: "#000", strokeStyle: "#000", lineWidth: 1, globalAlpha: 1,
      font: "11px sans-serif", textAlign: "left", textBaseline: "alphabetic", lineJoin: "round", dash: [], stack: [],
      shift: [0, 0], turned: "", clips: 0, open: 0,
    });
  }

  save() {
    this.stack.push({ fillStyle: this.fillStyle, strokeStyle: this.strokeStyle, lineWidth: this.lineWidth, globalAlpha: this.globalAlpha, font: this.font, textAlign: this.textAlign, textBaseline: this.textBaseline, dash: this.dash, shift: this.shift, turned: this.turned, open: this.open });
    this.open = 0;
  }

  restore() {
    for (; this.open > 0; this.open -= 1) this.parts.push("</g>");
    Object.assign(this, this.stack.pop());
  }

  setLineDash(dash) { this.dash = dash; }
  translate(x, y) { this.shift = [this.shift[0] + x, this.shift[1] + y]; }
  rotate(angle) { this.turned = ` rotate(${(angle * 180) / Math.PI})`; }
  at(x, y) { return `${(x + this.shift[0]).toFixed(2)} ${(y + this.shift[1]).toFixed(2)}`; }
  beginPath() { this.path = ""; }
  moveTo(x, y) { this.path += `M${this.at(x, y)}`; }
  lineTo(x, y) { this.path += `L${this.at(x, y)}`; }
  closePath() { this.path += "Z"; }
  rect(x, y, w, h) { this.moveTo(x, y); this.lineTo(x + w, y); this.lineTo(x + w, y + h); this.lineTo(x, y + h); this.closePath(); }

  arc(x, y, r) {
    this.moveTo(x - r, y);
    this.path += `a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
  }

  clip() {
    this.clips += 1;
    this.parts.push(`<clipPath id="clip${this.clips}"><path d="${this.path}"/></clipPath><g clip-path="url(#clip${this.clips})">`);
    this.open += 1;
  }

  stroke() {
    const dash = this.dash.length ? ` stroke-dasharray="${this.dash.join(" ")}"` : "";
    this.parts.push(`<path d="${this.path}" fill="none" stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}" stroke-linejoin="round"${dash}${this.faint()}/>`);
  }

  fill() { this.parts.push(`<path d="${this.path}" fill="${this.fillStyle}"${this.faint()}/>`); }
  fillRect(x, y, w, h) { this.beginPath(); this.rect(x, y, w, h); this.fill(); }
  strokeRect(x, y, w, h) { this.beginPath(); this.rect(x, y, w, h); this.stroke(); }

  fillText(text, x, y) {
    const anchor = { left: "start", start: "start", center: "middle", right: "end", end: "end" }[this.textAlign];
    const base = { top: "hanging", middle: "central" }[this.textBaseline] ?? "auto";
    const [, size, family] = /([\d.]+)px (.*)/.exec(this.font);
    const place = `translate(${this.at(x, y).replace(" ", ",")})${this.turned}`;
    this.parts.push(`<text transform="${place}" font-size="${size}" font-family="${escape(family)}" text-anchor="${anchor}" dominant-baseline="${base}" fill="${this.fillStyle}"${this.faint()}>${escape(text)}</text>`);
  }

  measureText(text) { return { width: 0.55 * parseFloat(/([\d.]+)px/.exec(this.font)[1]) * text.length }; }

  drawImage(image, x, y, w, h) {
    this.parts.push(`<image href="${image.toDataURL()}" x="${x}" y="${y}" width="${w}" height="${h}" preserveAspectRatio="none" style="image-rendering:pixelated"/>`);
  }

  faint() { return this.globalAlpha < 1 ? ` opacity="${this.globalAlpha}"` : ""; }

  text() {
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${this.width}" height="${this.height}" viewBox="0 0 ${this.width} ${this.height}">${this.parts.join("\n")}</svg>\n`;
  }
}

const escape = (text) => String(text).replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);

/** A canvas that fills its element and is drawn anew when that changes its size. */
export function surface(element, paint, label) {
  const canvas = element.appendChild(document.createElement("canvas"));
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", label);
  const context = canvas.getContext("2d");
  let size = [0, 0];
  const draw = () => {
    const ratio = globalThis.devicePixelRatio || 1;
    const [width, height] = size;
    if (width < 20 || height < 20) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      // As large as it is drawn, also where the element ends between two pixels.
      canvas.style.width = `${width}px`;
      canvas.style.height = `${height}px`;
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    paint(context, width, height);
  };
  new ResizeObserver(([entry]) => {
    size = [Math.floor(entry.contentRect.width), Math.floor(entry.contentRect.height)];
    draw();
  }).observe(element);
  return { canvas, draw, size: () => size };
}
