/* Plots over time that scroll: rig against twin, rig minus twin, and the balances. */
'use strict';

const DELAY = 0.12; // s behind the newest sample, so that new ones are there before they are seen
const visible = new Set();
const watcher = new IntersectionObserver(entries => {
  for (const {target, isIntersecting} of entries)
    isIntersecting ? visible.add(target) : visible.delete(target);
});

/* The instant at the right edge: runs evenly, whatever the rhythm in which samples come. */
class Edge {
  constructor() {
    this.offset = null;
  }

  arrived(end) {
    const target = end - performance.now() / 1000;
    if (this.offset === null || Math.abs(target - this.offset) > 0.4) this.offset = target;
    else this.offset += 0.05 * (target - this.offset);
  }

  now() {
    return this.offset === null ? 0 : this.offset + performance.now() / 1000 - DELAY;
  }
}

/* A range that grows at once and shrinks late, so that an axis does not tremble. */
function steadyRange(floor, room) {
  let low = null,
    high = null;
  return (u, from, to) => {
    if (from === null || to === null) return low === null ? [-1.4, 1.4] : [low, high];
    [from, to] = roomy(Math.min(from, -floor || from), Math.max(to, floor || to));
    [from, to] = [from - room * (to - from), to + room * (to - from)];
    const slim = to - from < 0.5 * (high - low);
    if (low === null || from < low || to > high || slim) [low, high] = [from, to];
    return [low, high];
  };
}

/* Even ticks of an upright axis, none where the ends of the axis would cut its label. */
function inside(u, low, high, font) {
  const height = u.over.clientHeight || 100,
    room = Math.min(0.3, (0.6 * font) / height) * (high - low);
  let found = readable(low + room, high - room, height - 1.2 * font, false, font);
  while (found.length > 2 && found.length * 1.5 * font > height) {
    const step = found[1] - found[0]; // too many for so low a plot: every second one, with zero
    found = found.filter(value => Math.round(value / step) % 2 === 0);
  }
  return found;
}

class TimePlot {
  constructor(place, {names, colours, unit, height, across, floor = 0, events}) {
    this.names = names;
    this.place = place;
    this.fresh = false;
    this.tones = {fine: colour('fine'), far: colour('far'), other: colour('augmented')};
    const font = 0.76 * rem();
    const options = {
      height: height * (rem() / 16) + (across ? 0 : 4),
      legend: {show: false},
      cursor: {show: false},
      padding: [6, 8, across ? 0 : 4, 0],
      scales: {
        x: {time: false, auto: false},
        y: {range: steadyRange(floor, height < 100 ? 0.2 : 0)},
      },
      series: [
        {},
        ...names.map((name, k) => ({
          stroke: colour(colours[k]),
          width: k ? 1.2 : 1.6,
          points: {show: false},
        })),
      ],
      axes: [
        axis(
          true,
          across ? {} : {size: 0, ticks: {show: false}, values: () => [], grid: {show: false}},
        ),
        axis(false, {splits: (u, _, low, high) => inside(u, low, high, font), size: 4.9 * font}),
      ],
      hooks: {draw: [u => this.mark(u, floor, events())]},
    };
    this.plot = grown(place, options, [[], ...names.map(() => [])]);
    watcher.observe(place);
  }

  /* The noise floor as a band, and a line for each event. */
  mark(u, floor, events) {
    const {ctx, bbox} = u;
    ctx.save();
    if (floor) {
      const [top, bottom] = [u.valToPos(floor, 'y', true), u.valToPos(-floor, 'y', true)];
      ctx.globalAlpha = 0.18;
      ctx.fillStyle = this.tones.fine;
      ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
    }
    ctx.globalAlpha = 0.8;
    ctx.setLineDash([4, 3]);
    for (const {at, kind} of events) {
      if (at < u.scales.x.min || at > u.scales.x.max) continue;
      const x = Math.round(u.valToPos(at, 'x', true));
      ctx.strokeStyle = this.tones[kind === 'trouble' ? 'far' : 'other'];
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  }

  draw(times, buckets, low, high) {
    if (!visible.has(this.place)) {
      this.fresh = false;
      return;
    }
    this.plot.batch(() => {
      if (!this.fresh) {
        this.plot.setData([times(), ...this.names.map(name => buckets.line(name))], false);
        this.fresh = true;
      }
      this.plot.setScale('x', {min: low, max: high});
    });
  }

  remove() {
    watcher.unobserve(this.place);
    visible.delete(this.place);
    this.plot.stopWatching();
    this.plot.destroy();
    this.place.remove();
  }
}
