/* The page at work: recordings, channels, the window of time, copying, dark and light. */
'use strict';

const page = JSON.parse(document.getElementById('data').textContent, (_, value) => (value?.steps ? unpacked(value) : value));
const one = id => document.getElementById(id);
const made = (tag, text = '', className = '') => Object.assign(document.createElement(tag), {textContent: text, className});
const state = {recording: null, channels: new Set(), window: [0, 1], whole: [0, 1]};
let plots = [], overview = null;

const seriesOf = name => page.series.find(entry => entry.recording === name);
const equationsOf = name => page.equations.filter(entry => entry.recording === name);
const finite = value => value !== null && value !== undefined && isFinite(value);
const less = (a, b) => a.map((value, k) => (finite(value) && finite(b?.[k]) ? value - b[k] : null));

/* Root mean square of what is drawn within the window of time. */
function rms(t, values, factor) {
  let sum = 0, count = 0;
  t.forEach((at, k) => { if (at >= state.window[0] && at <= state.window[1] && finite(values[k])) { sum += values[k] ** 2; count++; } });
  return count ? digits(Math.sqrt(sum / count) / factor, 3) : '–';
}

/* Shows the same stretch of time in every plot. */
function setWindow(low, high) {
  const [first, last] = state.whole, least = (last - first) / 20000;
  if (!finite(low) || !finite(high)) return;
  if (high - low < least) high = low + least;
  const span = Math.min(high - low, last - first);
  low = Math.max(first, Math.min(low, last - span));
  state.window = [low, low + span];
  for (const plot of plots) { plot.setScale('x', {min: low, max: low + span}); plot.said?.(); }
  const places = Math.max(2, Math.ceil(-Math.log10(span)) + 2);
  one('from').value = +low.toFixed(places);
  one('to').value = +(low + span).toFixed(places);
  markOverview();
}

function markOverview() {
  if (!overview) return;
  const [left, right] = state.window.map(t => overview.valToPos(t, 'x'));
  overview.setSelect({left, width: Math.max(2, right - left), top: 0, height: overview.over.clientHeight}, false);
}

const dragged = u => {
  const {left, width} = u.select;
  if (width < 4) return;
  const ends = [u.posToVal(left, 'x'), u.posToVal(left + width, 'x')];
  if (u !== overview) u.setSelect({left: 0, width: 0, top: 0, height: 0}, false);
  setWindow(...ends);
};
const mouse = () => ({
  y: false, drag: {x: true, y: false, setScale: false, dist: 4},
  bind: {dblclick: () => () => { setWindow(...state.whole); return null; }},
});

/* One finger reads values, two fingers hold the two instants under them. */
function touched(plot) {
  let held = null;
  const shares = event => {
    const box = plot.over.getBoundingClientRect();
    return [...event.touches].map(finger => (finger.clientX - box.left) / box.width).sort((a, b) => a - b);
  };
  const start = event => {
    held = event.touches.length === 2 ? shares(event).map(share => state.window[0] + share * (state.window[1] - state.window[0])) : null;
  };
  const move = event => {
    const [left, right] = shares(event), {clientX, clientY} = event.touches[0];
    if (held && right !== undefined) {
      const span = (held[1] - held[0]) / Math.max(0.05, right - left);
      setWindow(held[0] - left * span, held[0] + (1 - left) * span);
    } else plot.over.dispatchEvent(new MouseEvent('mousemove', {clientX, clientY}));
  };
  for (const [kind, act] of [['touchstart', start], ['touchmove', move], ['touchend', start]]) plot.over.addEventListener(kind, act, {passive: true});
}

/* One plot over time: lines [{name, tone, width, values}], with the band of noise around zero. */
function timePlot({title, unit, t, lines, noise, height, said}) {
  const shown = shownUnit(unit, largest(lines.map(line => line.values)));
  const card = one('plots').lastElementChild, head = made('div', '', 'head'), place = made('div');
  head.append(made('h3', title), made('span', shown.unit));
  head.firstChild.append(made('small', shown.unit ? `, ${shown.unit}` : ''));
  card.append(head, place);
  const shade = colour('fine', 22);
  const band = u => {
    if (!finite(noise)) return;
    const {left, top, width, height: tall} = u.bbox, ends = [noise, -noise].map(v => u.valToPos(v / shown.factor, 'y', true));
    u.ctx.save(); u.ctx.beginPath(); u.ctx.rect(left, top, width, tall); u.ctx.clip();
    u.ctx.fillStyle = shade;
    u.ctx.fillRect(left, ends[0], width, Math.max(1, ends[1] - ends[0]));
    u.ctx.restore();
  };
  const plot = grown(place, {
    height: Math.round(height * rem()), padding: [8, 16, 0, 0],
    cursor: {...mouse(), sync: {key: 'time', setSeries: false, scales: ['x', null], filters: {pub: type => type === 'mousemove' || type === 'mouseleave'}}},
    scales: {x: {time: false, range: () => state.window}, y: {range: (u, low, high) => roomy(low, high, said)}},
    axes: [axis(true, {values: (u, splits) => labels(splits).map(label => `${label} s`)}), axis(false)],
    series: [{label: 'time', value: read('s', 6)},
      ...lines.map(line => ({label: line.name, stroke: colour(line.tone), width: line.width || 1.3, points: {show: false}, value: read(shown.unit)}))],
    hooks: {setSelect: [dragged], drawAxes: [band]},
  }, [t, ...lines.map(line => line.values.map(v => (finite(v) ? v / shown.factor : null)))]);
  plot.said = () => {
    head.lastChild.textContent = said ? 'RMS in view: ' + lines.map(line => `${line.name} ${rms(t, line.values, shown.factor)}`).join(', ') + (finite(noise) ? `, noise ${digits(noise / shown.factor, 3)}` : '') : '';
  };
  touched(plot);
  plots.push(plot);
}

function channelPlots(name, t, channel) {
  const label = spoken(name), errors = [];
  const lines = [['rig', 'rig', channel.rig, 2.4], ['twin as given', 'twin', channel.as_given], ['augmented', 'augmented', channel.augmented]]
    .filter(([, , values]) => values?.length).map(([title, tone, values, width]) => ({name: title, tone, values, width}));
  if (channel.rig?.length)
    for (const line of lines) if (line.tone !== 'rig') errors.push({...line, values: less(channel.rig, line.values)});
  one('plots').append(made('div', '', 'card'));
  timePlot({title: label, unit: channel.unit, t, lines, height: 14});
  if (errors.length) timePlot({title: `error of the ${label}, rig less twin`, unit: channel.unit, t, lines: errors, noise: channel.noise, height: 9.5, said: true});
}

function drawPlots() {
  for (const plot of plots) { plot.stopWatching(); plot.destroy(); }
  plots = [];
  one('plots').replaceChildren();
  const series = seriesOf(state.recording);
  for (const [name, channel] of Object.entries(series?.channels || {})) if (state.channels.has(name)) channelPlots(name, series.t, channel);
  for (const entry of equationsOf(state.recording)) {
    one('plots').append(made('div', '', 'card'));
    const lines = [['before', 'twin', entry.before], ['after', 'augmented', entry.after]]
      .filter(([, , values]) => values?.length).map(([title, tone, values]) => ({name: title, tone, values}));
    timePlot({title: `residual of the ${spoken(entry.equation)} equation`, unit: entry.unit, t: entry.t, lines, height: 9.5, said: true});
  }
  setWindow(...state.window);
}

/* The whole recording, small, with the window in it. */
function drawOverview() {
  if (overview) { overview.stopWatching(); overview.destroy(); overview = null; }
  const series = seriesOf(state.recording), entry = equationsOf(state.recording)[0];
  const values = Object.entries(series?.channels || {}).find(([name, c]) => state.channels.has(name) && c.rig?.length)?.[1].rig || entry?.before;
  if (!values) return;
  overview = grown(one('overview'), {
    height: Math.round(4.6 * rem()), padding: [4, 16, 0, 0], legend: {show: false}, cursor: {...mouse(), x: false, points: {show: false}},
    scales: {x: {time: false, range: () => state.whole}, y: {range: (u, low, high) => roomy(low, high)}},
    axes: [axis(true, {values: (u, splits) => labels(splits).map(label => `${label} s`)}), axis(false, {values: (u, splits) => splits.map(() => ''), splits: () => []})],
    series: [{}, {stroke: colour('rig'), width: 1, points: {show: false}}],
    hooks: {setSelect: [dragged], setSize: [markOverview]},
  }, [series?.channels && values !== entry?.before ? series.t : entry.t, values]);
  markOverview();
}

/* How far a channel is off, in units of its noise or of its own movement. */
function departure(channel) {
  const error = less(channel.rig || [], channel.as_given), scale = channel.noise || largest([channel.rig || []]) || 1;
  return Math.sqrt(error.reduce((sum, v) => sum + (v || 0) ** 2, 0) / Math.max(1, error.length)) / scale;
}

function drawChips() {
  const channels = Object.keys(seriesOf(state.recording)?.channels || {});
  one('channels').replaceChildren(...channels.map(name => {
    const chip = made('button', spoken(name));
    chip.type = 'button';
    chip.setAttribute('aria-pressed', state.channels.has(name));
    chip.onclick = () => {
      if (!state.channels.delete(name)) state.channels.add(name);
      drawChips(); drawOverview(); drawPlots();
    };
    return chip;
  }));
}

function choose(recording) {
  const series = seriesOf(recording), times = [series?.t, ...equationsOf(recording).map(entry => entry.t)].filter(t => t?.length);
  if (!times.length) return;
  state.recording = recording;
  state.whole = [Math.min(...times.map(t => t[0])), Math.max(...times.map(t => t[t.length - 1]))];
  if (!(state.whole[1] > state.whole[0])) state.whole[1] = state.whole[0] + 1;
  state.window = [...state.whole];
  const names = Object.keys(series?.channels || {});
  if (!names.some(name => state.channels.has(name)))
    state.channels = new Set(names.map(name => [departure(series.channels[name]), name]).sort((a, b) => b[0] - a[0]).slice(0, 2).map(pair => pair[1]));
  drawChips(); drawOverview(); drawPlots();
}

/* The stretch with the largest error as given of the first channel that is shown. */
function worst() {
  const series = seriesOf(state.recording), name = Object.keys(series?.channels || {}).find(key => state.channels.has(key));
  const entry = equationsOf(state.recording)[0], t = name ? series.t : entry?.t;
  if (!t) return;
  const error = name ? less(series.channels[name].rig || [], series.channels[name].as_given) : entry.before;
  const at = t[error.reduce((best, v, k) => (Math.abs(v || 0) > Math.abs(error[best] || 0) ? k : best), 0)];
  const half = Math.min(1.5, (state.whole[1] - state.whole[0]) / 12);
  setWindow(at - half, at + half);
}

const MOVES = {
  back: (low, high, span) => [low - span / 2, high - span / 2], on: (low, high, span) => [low + span / 2, high + span / 2],
  in: (low, high, span) => [low + span / 4, high - span / 4], out: (low, high, span) => [low - span / 2, high + span / 2],
  all: () => state.whole,
};

function startSignals() {
  const names = [...new Set([...page.series, ...page.equations].map(entry => entry.recording))], groups = {};
  for (const name of names) {
    const {purpose = '', family = ''} = seriesOf(name) || {};
    groups[purpose] ||= one('recording').appendChild(Object.assign(document.createElement('optgroup'), {label: purpose || 'recordings'}));
    const choice = groups[purpose].appendChild(made('option', `${name}${family ? ' · ' + spoken(family) : ''}`));
    choice.value = name;
  }
  const first = page.series.find(entry => entry.purpose === 'report') || page.series[0] || page.equations[0];
  one('recording').value = first.recording;
  one('recording').onchange = event => choose(event.target.value);
  for (const end of ['from', 'to']) one(end).onchange = () => setWindow(...['from', 'to'].map(id => parseFloat(one(id).value.replace(',', '.').replace('−', '-'))));
  for (const button of document.querySelectorAll('[data-window]')) {
    const move = MOVES[button.dataset.window];
    button.onclick = () => (move ? setWindow(...move(...state.window, state.window[1] - state.window[0])) : worst());
  }
  choose(first.recording);
}

/* Puts text on the clipboard, also where the browser has no clipboard for a file. */
async function copy(text) {
  try { await navigator.clipboard.writeText(text); } catch {
    const box = document.body.appendChild(made('textarea'));
    box.value = text; box.select();
    document.execCommand('copy'); box.remove();
  }
}
for (const button of document.querySelectorAll('[data-copy]')) {
  button.onclick = async () => {
    await copy(one(button.dataset.copy).textContent);
    button.textContent = 'copied';
    setTimeout(() => { button.textContent = 'copy'; }, 1500);
  };
}

for (const section of document.querySelectorAll('section[data-nav]'))
  document.querySelector('nav').append(Object.assign(made('a', section.dataset.nav), {href: `#${section.id}`}));

let curves = [];
function draw() {
  for (const plot of curves) { plot.stopWatching(); plot.destroy(); }
  curves = [...document.querySelectorAll('[data-curve]')].map(place => curvePlot(place, page.curves[+place.dataset.curve]));
  if (state.recording !== null) { drawOverview(); drawPlots(); }
}
one('theme').onclick = () => {
  const next = {'': 'dark', dark: 'light', light: ''}[document.documentElement.style.colorScheme];
  document.documentElement.style.colorScheme = next;
  one('theme').title = `colours: ${next || 'as the system has them'}`;
  one('theme').setAttribute('aria-label', one('theme').title);
  draw();
};
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', draw);
draw();
if (one('controls')) startSignals();
