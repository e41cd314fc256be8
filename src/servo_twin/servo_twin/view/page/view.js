/* The page: joins connection, plots and panels. */
'use strict';

const SIGNALS = ['load_position', 'motor_position', 'torque', 'current'];
const BALANCES = [
  'drive',
  'motor',
  'transmission',
  'load',
  'controller',
  'sensor',
  'torque_balance',
];
const buckets = new Buckets(),
  edge = new Edge();
const state = {
  span: 10,
  held: null,
  channels: new Set(['load_position', 'torque']),
  units: {},
  events: [],
  shown: '',
  kept: 0,
  control: false,
};
let plots = [],
  spectrum = new Spectrum(one('spectrum')),
  values = null,
  faults = null,
  frames = 0;

const balanceNames = () => BALANCES.filter(name => buckets.known(`balance.${name}`));

/* What is asked of the server: the names on the page, as many buckets as the plot has pixels. */
function ask() {
  const names = [
    ...SIGNALS.filter(name => state.channels.has(name)).flatMap(name => [
      name,
      `twin.${name}`,
      `gap.${name}`,
    ]),
    ...BALANCES.map(name => `balance.${name}`),
  ];
  const pixels = Math.max(100, Math.round((one('plots').clientWidth - 60) / 1.5));
  link.say({show: {names, span: state.span, pixels, spectrum: one('spectrum-of').value}});
}

/* Makes the plots again: other channels, other balances, other colours. */
function remake() {
  for (const plot of plots) plot.remove();
  one('signals').replaceChildren();
  one('balances').replaceChildren();
  plots = [];
  const events = () => state.events;
  for (const name of SIGNALS.filter(name => state.channels.has(name))) {
    const card = made('div', '', 'card'),
      head = made('div', '', 'head'),
      key = made('span', '', 'key');
    key.append(
      made('i', '', 'rig'),
      'rig',
      made('i', '', 'twin'),
      'twin',
      made('i', '', 'gap'),
      'rig minus twin',
    );
    head.append(made('h2', `${spoken(name)}, ${pretty(state.units[name])}`), key);
    const upper = made('div'),
      lower = made('div');
    card.append(head, upper, lower);
    one('signals').append(card);
    plots.push(
      new TimePlot(upper, {
        names: [name, `twin.${name}`],
        colours: ['rig', 'twin'],
        height: 140,
        across: false,
        events,
      }),
    );
    plots.push(
      new TimePlot(lower, {
        names: [`gap.${name}`],
        colours: ['law'],
        height: 96,
        across: true,
        events,
      }),
    );
  }
  const found = balanceNames();
  found.forEach((name, k) => {
    const place = made('div', '', 'strip');
    place.append(made('b', spoken(name)));
    one('balances').append(place);
    plots.push(
      new TimePlot(place.appendChild(made('div')), {
        names: [`balance.${name}`],
        colours: ['law'],
        height: k === found.length - 1 ? 92 : 68,
        across: k === found.length - 1,
        floor: 1,
        events,
      }),
    );
  });
  one('balances-card').hidden = !found.length;
  state.shown = found.join();
}

function frame() {
  frames++;
  requestAnimationFrame(frame);
  if (!buckets.count) return;
  const high = state.held ?? Math.min(edge.now(), buckets.end);
  let times = null;
  const once = () => (times ??= buckets.times());
  for (const plot of plots) plot.draw(once, buckets, high - state.span, high);
}

const parts = {
  status({title, servo, said, level, nodes, warnings}) {
    const worst = Math.max(level, ...nodes.map(node => node.level));
    one('title').textContent = servo && servo !== 'none' ? `${servo}, ${title}` : title;
    document.title = `${one('title').textContent}: servo twin`;
    one('badge').textContent = said;
    one('head').className = level ? 'off' : worst > 1 ? 'far' : 'fine';
    one('facts').replaceChildren(
      ...nodes.map(node => {
        const fact = made('span', '', ['fine', 'off', 'far', 'unseen'][node.level] || 'unseen');
        fact.append(made('b', node.name), ` ${node.said}`);
        return fact;
      }),
    );
    one('warnings').hidden = !warnings.length;
    one('warnings').textContent = warnings.join('; ');
  },
  units(units) {
    if (JSON.stringify(units) === JSON.stringify(state.units)) return;
    state.units = units;
    remake();
    spectrum.remove();
  },
  levels: drawChain,
  events(events) {
    state.events = events;
    drawEvents(events);
  },
  diagnosis: drawDiagnosis,
  values(entries) {
    one('values-card').hidden = !entries.length;
    values?.draw(entries);
  },
  faults(facts) {
    one('faults-card').hidden = false;
    faults.draw(facts);
  },
  played({at, duration, playing}) {
    one('player').hidden = false;
    one('play').textContent = playing ? 'Pause' : 'Play';
    one('at').max = duration;
    if (document.activeElement !== one('at') || playing) one('at').value = at;
    one('place').textContent = `${at.toFixed(1)} of ${duration.toFixed(1)} s`;
  },
  rate({rate, kept}) {
    state.kept = kept;
    one('kept').textContent = `${kept} s of samples at ${+rate.toPrecision(4)} Hz are here.`;
  },
};

function hello({kind, control, units, names}) {
  Object.assign(state, {units, control, kind});
  values = new Values(one('values'), control && kind === 'rig', (path, value) =>
    link.say({set: {path, value}}),
  );
  faults = new Faults(one('faults'), (path, value) => link.say({fault: {path, value}}));
  one('may').textContent = control ? '' : 'read only';
  const chosen = one('spectrum-of').value || 'balance.load';
  one('spectrum-of').replaceChildren(
    ...names
      .filter(name => name.includes('.') && !name.startsWith('twin.'))
      .map(name => {
        const option = made(
          'option',
          spoken(name).replace('balance.', '').replace('gap.', 'gap, '),
        );
        option.value = name;
        return option;
      }),
  );
  one('spectrum-of').value = chosen;
  remake();
  ask();
}

const link = new Link({
  told(message) {
    if (message.hello) hello(message.hello);
    for (const [name, fact] of Object.entries(message.facts || {})) parts[name]?.(fact);
    if (message.spectrum) spectrum.draw(message.spectrum, state.units);
    one('refused').hidden = !message.refused && one('refused').hidden;
    if (message.refused) {
      one('refused').hidden = false;
      one('refused').textContent = message.refused;
      setTimeout(() => (one('refused').hidden = true), 8000);
    }
  },
  samples(message) {
    if (state.held !== null && !message.whole) return;
    const began = message.whole;
    buckets.take(message, state.span);
    if (began) edge.offset = null;
    if (buckets.count) edge.arrived(buckets.end);
    for (const plot of plots) plot.fresh = false;
    if (balanceNames().join() !== state.shown) remake();
  },
  gone() {
    one('badge').textContent = 'no connection, trying again';
    one('head').className = 'far';
  },
});

for (const name of SIGNALS) {
  const chip = made('button', spoken(name));
  chip.type = 'button';
  chip.setAttribute('aria-pressed', state.channels.has(name));
  chip.onclick = () => {
    state.channels.has(name) ? state.channels.delete(name) : state.channels.add(name);
    chip.setAttribute('aria-pressed', state.channels.has(name));
    remake();
    ask();
  };
  one('channels').append(chip);
}
one('span').onchange = () => {
  state.span = parseFloat(one('span').value);
  ask();
};
one('pause').onclick = () => {
  state.held = state.held === null ? edge.now() : null;
  one('pause').setAttribute('aria-pressed', state.held !== null);
  one('pause').textContent = state.held === null ? 'Hold' : 'Go on';
  if (state.held === null) ask();
};
one('spectrum-of').onchange = ask;
one('diagnose').onclick = () => link.say({diagnose: true});
one('cancel').onclick = () => link.say({diagnose: false});
one('play').onclick = () => link.say({play: {playing: one('play').textContent === 'Play'}});
one('at').oninput = () => link.say({play: {at: +one('at').value}});

function recoloured() {
  remake();
  spectrum.remove();
}
one('theme').onclick = () => {
  const next = {'': 'dark', dark: 'light', light: ''}[document.documentElement.style.colorScheme];
  document.documentElement.style.colorScheme = next;
  one('theme').title = `colours: ${next || 'as the system has them'}`;
  one('theme').setAttribute('aria-label', one('theme').title);
  recoloured();
};
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', recoloured);
let resized = null,
  width = innerWidth;
addEventListener('resize', () => {
  if (innerWidth === width) return;
  width = innerWidth;
  clearTimeout(resized);
  resized = setTimeout(() => {
    recoloured();
    ask();
  }, 200);
});
drawChain({});
requestAnimationFrame(frame);
