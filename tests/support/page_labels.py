"""Scripts for a page in a browser: every label in it, in its text and on its canvases."""

# Makes each canvas remember the labels that it shows.
RECORD_LABELS = """
const write = CanvasRenderingContext2D.prototype.fillText;
const wipe = CanvasRenderingContext2D.prototype.clearRect;
CanvasRenderingContext2D.prototype.clearRect = function (...box) {
  this.canvas.labels = [];
  return wipe.apply(this, box);
};
CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...more) {
  const size = this.measureText(text), at = this.getTransform().transformPoint({x, y});
  (this.canvas.labels ||= []).push({text, align: this.textAlign, bottom: this.textBaseline,
    left: at.x - size.actualBoundingBoxLeft, right: at.x + size.actualBoundingBoxRight,
    up: at.y - size.actualBoundingBoxAscent, down: at.y + size.actualBoundingBoxDescent});
  return write.call(this, text, x, y, ...more);
};
"""

# Pairs of labels of which one lies over the other, labels that are cut off, a page that is wide.
OVERLAPS = """(() => {
  const boxes = [], clipped = node => {
    let box = {left: 0, right: document.documentElement.clientWidth, top: -1e9, bottom: 1e9};
    for (let one = node; one && one !== document.body; one = one.parentElement) {
      if (getComputedStyle(one).overflow === 'visible') continue;
      const r = one.getBoundingClientRect();
      box = {left: Math.max(box.left, r.left), right: Math.min(box.right, r.right),
             top: Math.max(box.top, r.top), bottom: Math.min(box.bottom, r.bottom)};
    }
    return box;
  };
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const node = walk.currentNode, parent = node.parentElement;
    if (!node.data.trim() || !parent.checkVisibility({visibilityProperty: true})) continue;
    if (parent.closest('script, style, noscript, option')) continue;
    const range = document.createRange(), clip = clipped(parent);
    range.selectNodeContents(node);
    for (const r of range.getClientRects())
      boxes.push({text: node.data.trim().slice(0, 40), left: Math.max(r.left, clip.left),
                  right: Math.min(r.right, clip.right), up: Math.max(r.top, clip.top),
                  down: Math.min(r.bottom, clip.bottom), raw: r.right});
  }
  for (const canvas of document.querySelectorAll('canvas')) {
    const place = canvas.getBoundingClientRect();
    for (const l of canvas.labels || []) {
      if (!l.text) continue;
      boxes.push({text: l.text, left: place.left + l.left, right: place.left + l.right,
                  up: place.top + l.up, down: place.top + l.down, cut: l.left < -1 ||
                  l.right > canvas.width + 1 || l.up < -1 || l.down > canvas.height + 1});
    }
  }
  const bad = boxes.filter(b => b.cut).map(b => `cut off: ${b.text}`);
  if (document.documentElement.scrollWidth > document.documentElement.clientWidth)
    bad.push(`the page is ${document.documentElement.scrollWidth} px wide`);
  const shown = boxes.filter(b => b.right - b.left > 1 && b.down - b.up > 1);
  shown.sort((a, b) => a.up - b.up);
  shown.forEach((a, i) => {
    for (let j = i + 1; j < shown.length && shown[j].up < a.down - 2.5; j++) {
      const b = shown[j];
      if (Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1.5 &&
          Math.min(a.down, b.down) - b.up > 0.3 * Math.min(a.down - a.up, b.down - b.up))
        bad.push(`${a.text} | ${b.text}`);
    }
  });
  return bad;
})()"""

# How many ticks with a number each axis of each canvas has.
TICKS = """[...document.querySelectorAll('canvas')].map(canvas => {
  const count = align => (canvas.labels || [])
    .filter(l => l.align === align && /\\d/.test(l.text));
  return {x: count('center').length, y: count('right').length,
          small: canvas.height < 90 && !count('right').length};
})"""
