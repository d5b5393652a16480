// Where matching matters: a square of grey levels that a brush changes, and how it is seen over the picture.

export const SIDE = 256, PLAIN = 64; // pixels; the level of what nobody has painted

export class Painting {
  constructor() {
    this.levels = new Uint8Array(SIDE * SIDE).fill(PLAIN);
    this.canvas = document.createElement("canvas");
    this.canvas.width = this.canvas.height = SIDE;
  }

  /** Take over levels from the server; none at all: everything is alike. */
  take(bytes) {
    if (bytes.length === SIDE * SIDE) this.levels.set(bytes);
    else this.levels.fill(PLAIN);
  }

  get isPlain() { return this.levels.every(level => level === this.levels[0]); }

  /** A stroke of the brush from one place to another, in the unit square. */
  stroke([x0, y0], [x1, y1], radius, level) {
    const length = Math.hypot(x1 - x0, y1 - y0) * SIDE, n = Math.max(1, Math.ceil(length / (0.3 * radius)));
    for (let k = 0; k <= n; k++) this.dab(x0 + ((x1 - x0) * k) / n, y0 + ((y1 - y0) * k) / n, radius, level);
  }

  dab(x, y, radius, level) {
    const [cx, cy] = [x * SIDE, y * SIDE], from = v => Math.max(0, Math.floor(v - radius)), to = v => Math.min(SIDE - 1, Math.ceil(v + radius));
    for (let row = from(cy); row <= to(cy); row++)
      for (let column = from(cx); column <= to(cx); column++)
        if (Math.hypot(column + 0.5 - cx, row + 0.5 - cy) <= radius) this.levels[row * SIDE + column] = level;
  }

  /** The paint as a picture: what matters in one colour, what does not in another. */
  picture() {
    const context = this.canvas.getContext("2d"), image = context.createImageData(SIDE, SIDE);
    this.levels.forEach((level, k) => {
      const more = level > PLAIN, share = more ? (level - PLAIN) / (255 - PLAIN) : (PLAIN - level) / PLAIN;
      image.data.set([...(more ? [234, 88, 12] : [71, 85, 105]), Math.round((more ? 130 : 110) * share)], 4 * k);
    });
    context.putImageData(image, 0, 0);
    return this.canvas.toDataURL();
  }
}
