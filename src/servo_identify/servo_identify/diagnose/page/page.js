/* The page at work: recordings, channels, the window of time, copying, dark and light. */
'use strict';

/* How far a channel is off, in units of its noise or of its own movement. */
function departure(channel) {
  const error = less(channel.rig || [], channel.as_given),
    scale = channel.noise || largest([channel.rig || []]) || 1;
  return (
    Math.sqrt(error.reduce((sum, v) => sum + (v || 0) ** 2, 0) / Math.max(1, error.length)) / scale
  );
}

function drawChips() {
  const channels = Object.keys(seriesOf(state.recording)?.channels || {});
  one('channels').replaceChildren(
    ...channels.map(name => {
      const chip = made('button', spoken(name));
      chip.type = 'button';
      chip.setAttribute('aria-pressed', state.channels.has(name));
      chip.onclick = () => {
        if (!state.channels.delete(name)) state.channels.add(name);
        drawChips();
        drawOverview();
        drawPlots();
      };
      return chip;
    }),
  );
}

function choose(recording) {
  const series = seriesOf(recording),
    times = [series?.t, ...equationsOf(recording).map(entry => entry.t)].filter(t => t?.length);
  if (!times.length) return;
  state.recording = recording;
  state.whole = [Math.min(...times.map(t => t[0])), Math.max(...times.map(t => t[t.length - 1]))];
  if (!(state.whole[1] > state.whole[0])) state.whole[1] = state.whole[0] + 1;
  state.window = [...state.whole];
  const names = Object.keys(series?.channels || {});
  if (!names.some(name => state.channels.has(name)))
    state.channels = new Set(
      names
        .map(name => [departure(series.channels[name]), name])
        .sort((a, b) => b[0] - a[0])
        .slice(0, 2)
        .map(pair => pair[1]),
    );
  drawChips();
  drawOverview();
  drawPlots();
}

/* The stretch with the largest error as given of the first channel that is shown. */
function worst() {
  const series = seriesOf(state.recording),
    name = Object.keys(series?.channels || {}).find(key => state.channels.has(key));
  const entry = equationsOf(state.recording)[0],
    t = name ? series.t : entry?.t;
  if (!t) return;
  const error = name
    ? less(series.channels[name].rig || [], series.channels[name].as_given)
    : entry.before;
  const at =
    t[error.reduce((best, v, k) => (Math.abs(v || 0) > Math.abs(error[best] || 0) ? k : best), 0)];
  const half = Math.min(1.5, (state.whole[1] - state.whole[0]) / 12);
  setWindow(at - half, at + half);
}

const MOVES = {
  back: (low, high, span) => [low - span / 2, high - span / 2],
  on: (low, high, span) => [low + span / 2, high + span / 2],
  in: (low, high, span) => [low + span / 4, high - span / 4],
  out: (low, high, span) => [low - span / 2, high + span / 2],
  all: () => state.whole,
};

function startSignals() {
  const names = new Set([...page.series, ...page.equations].map(entry => entry.recording));
  const groups = new Map();
  for (const name of names) {
    const {purpose = '', family = ''} = seriesOf(name) || {};
    if (!groups.has(purpose)) {
      const group = document.createElement('optgroup');
      group.label = purpose || 'recordings';
      groups.set(purpose, one('recording').appendChild(group));
    }
    const choice = made('option', `${name}${family ? ' · ' + spoken(family) : ''}`);
    choice.value = name;
    groups.get(purpose).append(choice);
  }
  const first =
    page.series.find(entry => entry.purpose === 'report') || page.series[0] || page.equations[0];
  one('recording').value = first.recording;
  one('recording').onchange = event => choose(event.target.value);
  const typed = id => parseFloat(one(id).value.replace(',', '.').replace('−', '-'));
  for (const end of ['from', 'to'])
    one(end).onchange = () => setWindow(typed('from'), typed('to'));
  for (const button of document.querySelectorAll('[data-window]')) {
    const move = MOVES[button.dataset.window];
    button.onclick = () =>
      move ? setWindow(...move(...state.window, state.window[1] - state.window[0])) : worst();
  }
  choose(first.recording);
}

/* Puts text on the clipboard, also where the browser has no clipboard for a file. */
async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const box = document.body.appendChild(made('textarea'));
    box.value = text;
    box.select();
    document.execCommand('copy');
    box.remove();
  }
}
for (const button of document.querySelectorAll('[data-copy]')) {
  button.onclick = async () => {
    await copy(one(button.dataset.copy).textContent);
    button.textContent = 'copied';
    setTimeout(() => {
      button.textContent = 'copy';
    }, 1500);
  };
}

for (const section of document.querySelectorAll('section[data-nav]'))
  document
    .querySelector('nav')
    .append(Object.assign(made('a', section.dataset.nav), {href: `#${section.id}`}));

let curves = [];
function draw() {
  for (const plot of curves) {
    plot.stopWatching();
    plot.destroy();
  }
  curves = [...document.querySelectorAll('[data-curve]')].map(place =>
    curvePlot(place, page.curves[+place.dataset.curve]),
  );
  if (state.recording !== null) {
    drawOverview();
    drawPlots();
  }
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
