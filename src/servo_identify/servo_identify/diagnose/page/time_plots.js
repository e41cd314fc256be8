/* Plots over time, which all show the same window of one recording. */
'use strict';

const page = JSON.parse(document.getElementById('data').textContent, (_, value) =>
  Array.isArray(value?.steps) ? unpacked(value) : value,
);
const one = id => document.getElementById(id);
const made = (tag, text = '', className = '') =>
  Object.assign(document.createElement(tag), {textContent: text, className});
const state = {recording: null, channels: new Set(), window: [0, 1], whole: [0, 1]};
let plots = [],
  overview = null;

const seriesOf = name => page.series.find(entry => entry.recording === name);
const equationsOf = name => page.equations.filter(entry => entry.recording === name);
const finite = value => value !== null && value !== undefined && isFinite(value);
const less = (a, b) =>
  a.map((value, k) => (finite(value) && finite(b?.[k]) ? value - b[k] : null));

/* Root mean square of what is drawn within the window of time. */
function rms(t, values, factor) {
  let sum = 0,
    count = 0;
  t.forEach((at, k) => {
    if (at >= state.window[0] && at <= state.window[1] && finite(values[k])) {
      sum += values[k] ** 2;
      count++;
    }
  });
  return count ? digits(Math.sqrt(sum / count) / factor, 3) : '–';
}

/* Shows the same stretch of time in every plot. */
function setWindow(low, high) {
  const [first, last] = state.whole,
    least = (last - first) / 20000;
  if (!finite(low) || !finite(high)) [low, high] = state.window;
  if (high < low) [low, high] = [high, low];
  if (high - low < least) high = low + least;
  const span = Math.min(high - low, last - first);
  low = Math.max(first, Math.min(low, last - span));
  state.window = [low, low + span];
  for (const plot of plots) {
    plot.setScale('x', {min: low, max: low + span});
    plot.said?.();
  }
  const places = Math.max(2, Math.ceil(-Math.log10(span)) + 2);
  one('from').value = +low.toFixed(places);
  one('to').value = +(low + span).toFixed(places);
  markOverview();
}

const dragged = u => {
  const {left, width} = u.select;
  if (width < 4) return;
  const ends = [u.posToVal(left, 'x'), u.posToVal(left + width, 'x')];
  if (u !== overview) u.setSelect({left: 0, width: 0, top: 0, height: 0}, false);
  setWindow(...ends);
};
const mouse = () => ({
  y: false,
  drag: {x: true, y: false, setScale: false, dist: 4},
  bind: {
    dblclick: () => () => {
      setWindow(...state.whole);
      return null;
    },
  },
});

/* One finger reads values, two fingers hold the two instants under them. */
function touched(plot) {
  let held = null;
  const shares = event => {
    const box = plot.over.getBoundingClientRect();
    return [...event.touches]
      .map(finger => (finger.clientX - box.left) / box.width)
      .sort((a, b) => a - b);
  };
  const start = event => {
    held =
      event.touches.length === 2
        ? shares(event).map(share => state.window[0] + share * (state.window[1] - state.window[0]))
        : null;
  };
  const move = event => {
    const [left, right] = shares(event),
      {clientX, clientY} = event.touches[0];
    if (held && right !== undefined) {
      const span = (held[1] - held[0]) / Math.max(0.05, right - left);
      setWindow(held[0] - left * span, held[0] + (1 - left) * span);
    } else plot.over.dispatchEvent(new MouseEvent('mousemove', {clientX, clientY}));
  };
  for (const [kind, act] of [
    ['touchstart', start],
    ['touchmove', move],
    ['touchend', start],
  ])
    plot.over.addEventListener(kind, act, {passive: true});
}

/* One plot over time: lines [{name, tone, width, values}], with the band of noise around zero. */
function timePlot({title, unit, t, lines, noise, height, said}) {
  const shown = shownUnit(unit, largest(lines.map(line => line.values)));
  const card = one('plots').lastElementChild,
    head = made('div', '', 'head'),
    place = made('div');
  head.append(made('h3', title), made('span', shown.unit));
  head.firstChild.append(made('small', shown.unit ? `, ${shown.unit}` : ''));
  card.append(head, place);
  const shade = colour('fine', 22);
  const band = u => {
    if (!finite(noise)) return;
    const {left, top, width, height: tall} = u.bbox,
      ends = [noise, -noise].map(v => u.valToPos(v / shown.factor, 'y', true));
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(left, top, width, tall);
    u.ctx.clip();
    u.ctx.fillStyle = shade;
    u.ctx.fillRect(left, ends[0], width, Math.max(1, ends[1] - ends[0]));
    u.ctx.restore();
  };
  const plot = grown(
    place,
    {
      height: Math.round(height * rem()),
      padding: [8, 16, 0, 0],
      cursor: {
        ...mouse(),
        sync: {
          key: 'time',
          setSeries: false,
          scales: ['x', null],
          filters: {pub: type => type === 'mousemove' || type === 'mouseleave'},
        },
      },
      scales: {
        x: {time: false, range: () => state.window},
        y: {range: (u, low, high) => roomy(low, high, said)},
      },
      axes: [
        axis(true, {values: (u, splits) => labels(splits).map(label => `${label} s`)}),
        axis(false),
      ],
      series: [
        {label: 'time', value: read('s', 6)},
        ...lines.map(line => ({
          label: line.name,
          stroke: colour(line.tone),
          width: line.width || 1.3,
          points: {show: false},
          value: read(shown.unit),
        })),
      ],
      hooks: {setSelect: [dragged], drawAxes: [band]},
    },
    [t, ...lines.map(line => line.values.map(v => (finite(v) ? v / shown.factor : null)))],
  );
  plot.said = () => {
    head.lastChild.textContent = said
      ? 'RMS in view: ' +
        lines.map(line => `${line.name} ${rms(t, line.values, shown.factor)}`).join(', ') +
        (finite(noise) ? `, noise ${digits(noise / shown.factor, 3)}` : '')
      : '';
  };
  touched(plot);
  plots.push(plot);
}

function channelPlots(name, t, channel) {
  const label = spoken(name),
    errors = [];
  const lines = [
    ['rig', 'rig', channel.rig, 2.4],
    ['twin as given', 'twin', channel.as_given],
    ['augmented', 'augmented', channel.augmented],
  ]
    .filter(([, , values]) => values?.length)
    .map(([title, tone, values, width]) => ({name: title, tone, values, width}));
  if (channel.rig?.length)
    for (const line of lines)
      if (line.tone !== 'rig') errors.push({...line, values: less(channel.rig, line.values)});
  one('plots').append(made('div', '', 'card'));
  timePlot({title: label, unit: channel.unit, t, lines, height: 14});
  if (errors.length)
    timePlot({
      title: `error of the ${label}, rig less twin`,
      unit: channel.unit,
      t,
      lines: errors,
      noise: channel.noise,
      height: 9.5,
      said: true,
    });
}

function drawPlots() {
  for (const plot of plots) {
    plot.stopWatching();
    plot.destroy();
  }
  plots = [];
  one('plots').replaceChildren();
  const series = seriesOf(state.recording);
  for (const [name, channel] of Object.entries(series?.channels || {}))
    if (state.channels.has(name)) channelPlots(name, series.t, channel);
  for (const entry of equationsOf(state.recording)) {
    one('plots').append(made('div', '', 'card'));
    const lines = [
      ['before', 'twin', entry.before],
      ['after', 'augmented', entry.after],
    ]
      .filter(([, , values]) => values?.length)
      .map(([title, tone, values]) => ({name: title, tone, values}));
    timePlot({
      title: `residual of the ${spoken(entry.equation)} equation`,
      unit: entry.unit,
      t: entry.t,
      lines,
      height: 9.5,
      said: true,
    });
  }
  setWindow(...state.window);
}
