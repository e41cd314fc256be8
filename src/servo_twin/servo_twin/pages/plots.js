/* What every plot of the page shares: ticks, units, colours, and one time window for all. */
'use strict';

const SHORTENED = /^(rad|N|A|V|m|W|Hz|J)(?![A-Za-z%])/;
const PREFIXES = [
  [1e-12, 'p'],
  [1e-9, 'n'],
  [1e-6, 'µ'],
  [1e-3, 'm'],
  [1, ''],
  [1e3, 'k'],
  [1e6, 'M'],
];
const RAISED = {
  '-': '⁻',
  0: '⁰',
  1: '¹',
  2: '²',
  3: '³',
  4: '⁴',
  5: '⁵',
  6: '⁶',
  7: '⁷',
  8: '⁸',
  9: '⁹',
};

const raised = power => [...String(power)].map(sign => RAISED[sign]).join('');
const minus = text => text.replace('-', '−');
const pretty = unit =>
  String(unit || '').replace(/([A-Za-z])([23])\b/g, (_, a, n) => a + RAISED[n]);
const spoken = name => String(name).replaceAll('_', ' ');
const rem = () => parseFloat(getComputedStyle(document.documentElement).fontSize);

/* Samples from whole steps of a quantum, each counted from the one before; null where none is. */
function unpacked({quantum, steps}) {
  let sum = 0;
  return steps.map(step => (step === null ? null : (sum += step) * quantum));
}

/* A value with four digits, as it is read under the cursor. */
function digits(value, count = 4) {
  if (value === null || value === undefined || !isFinite(value)) return '–';
  if (value !== 0 && (Math.abs(value) >= 1e6 || Math.abs(value) < 1e-4)) {
    const [head, power] = value.toExponential(count - 1).split('e');
    return `${minus(head)} × 10${raised(+power)}`;
  }
  return minus(String(+value.toPrecision(count)));
}

/* What the legend says of the sample under the cursor. */
const read =
  (unit, count = 4) =>
  (u, value) =>
    value === null || value === undefined ? '' : `${digits(value, count)} ${unit}`;

/* The factor and unit in which the largest of some values has one to three whole digits. */
function shownUnit(unit, largest) {
  const name = pretty(unit);
  if (!(largest > 0) || (largest >= 0.02 && largest < 2e4)) return {factor: 1, unit: name};
  if (SHORTENED.test(name)) {
    const [factor, prefix] = PREFIXES.findLast(([size]) => largest / size >= 0.2) || PREFIXES[0];
    return {factor, unit: prefix + name};
  }
  const power = 3 * Math.floor(Math.log10(largest * 5) / 3);
  return {factor: 10 ** power, unit: `10${raised(power)}${name ? ' ' + name : ''}`};
}

/* At most so many even ticks from low to high, and never fewer than two. */
function ticks(low, high, most) {
  const span = high - low;
  if (!(span > 0)) return [low];
  let power = Math.floor(Math.log10(span / most)),
    step = null;
  for (let k = 0; k < 12; k++) {
    const next = [1, 2, 5][k % 3] * 10 ** (power + Math.floor(k / 3));
    const count = Math.floor(high / next + 1e-9) - Math.ceil(low / next - 1e-9) + 1;
    if (count < 2) break;
    step = next;
    if (count <= most) break;
  }
  if (step === null) return [low, high];
  const first = Math.ceil(low / step - 1e-9),
    last = Math.floor(high / step + 1e-9);
  return Array.from({length: last - first + 1}, (_, k) => +((first + k) * step).toPrecision(12));
}

function labels(values) {
  const step = values.length > 1 ? Math.abs(values[1] - values[0]) : 1;
  const places = Math.max(0, Math.min(9, -Math.floor(Math.log10(step) + 1e-9)));
  return values.map(value => minus(value.toFixed(places)));
}

/* The ticks of an axis whose labels leave room between them. */
function readable(low, high, length, across, font) {
  for (let most = Math.max(2, Math.floor(length / ((across ? 6.5 : 2.4) * font))); ; most--) {
    const found = ticks(low, high, most);
    const widest = Math.max(...labels(found).map(label => label.length)) * 0.62 * font;
    if (most <= 2 || found.length * (across ? widest + font : 1.7 * font) <= length) return found;
  }
}

/* A colour of the style sheet as the browser computes it, dark or light. */
function colour(name, share = 100) {
  const probe = document.body.appendChild(document.createElement('i'));
  probe.style.color = `color-mix(in srgb, var(--${name}) ${share}%, transparent)`;
  const found = getComputedStyle(probe).color;
  probe.remove();
  return found;
}

function axis(across, overrides) {
  const font = 0.76 * rem();
  return {
    stroke: colour('soft'),
    font: `${font}px ${getComputedStyle(document.body).fontFamily}`,
    grid: {stroke: colour('line'), width: 1, show: !across},
    ticks: {stroke: colour('line'), size: across ? 4 : 0},
    size: across ? 1.9 * font + 6 : 4.6 * font,
    gap: 5,
    splits: (u, _, low, high) =>
      readable(
        low,
        high,
        across
          ? u.over.clientWidth || u.width - 5 * font
          : u.over.clientHeight || u.height - 3 * font,
        across,
        font,
      ),
    values: (u, splits) => labels(splits),
    ...overrides,
  };
}

/* Some room above and below the values that are seen; errors are seen from zero. */
function roomy(low, high, zero = false) {
  if (!isFinite(low) || !isFinite(high)) return [-1, 1];
  if (zero) [low, high] = [Math.min(low, 0), Math.max(high, 0)];
  const room = 0.07 * (high - low) || 0.1 * Math.abs(high) || 1;
  return [low - room, high + room];
}

const largest = lists =>
  lists.flat().reduce((most, value) => Math.max(most, Math.abs(value || 0)), 0);

/* Builds a plot that follows the width of its place. */
function grown(place, options, values) {
  const plot = new uPlot({...options, width: Math.max(200, place.clientWidth)}, values, place);
  const watch = new ResizeObserver(() => {
    const width = Math.floor(place.clientWidth);
    if (width > 0 && width !== plot.width) plot.setSize({width, height: options.height});
  });
  watch.observe(place);
  plot.stopWatching = () => watch.disconnect();
  return plot;
}
