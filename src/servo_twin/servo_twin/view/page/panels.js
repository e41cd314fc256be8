/* What stands beside the plots: spectrum, events and diagnosis. */
'use strict';

const one = id => document.getElementById(id);
const made = (tag, text = '', className = '') =>
  Object.assign(document.createElement(tag), {textContent: text, className});
const seconds = at => `${minus(at.toFixed(2))} s`;

/* Spectrum of what was chosen, both axes logarithmic. */
class Spectrum {
  constructor(place) {
    this.place = place;
    this.plot = null;
    this.unit = '';
  }

  draw({name, frequency, density}, units) {
    const there = frequency.length > 1;
    one('spectrum-none').hidden = there;
    this.place.hidden = !there;
    if (!there) {
      this.remove();
      return;
    }
    if (!this.plot || this.name !== name) {
      this.remove();
      this.name = name;
      this.make(`${pretty(units[name])} / √Hz`);
    }
    this.plot.setData([frequency, density.map(value => (value > 0 ? value : null))]);
  }

  make(unit) {
    const decade = {
      filter: (u, splits) => splits,
      splits: (u, _, low, high) => {
        const first = Math.ceil(Math.log10(low) - 1e-9),
          last = Math.floor(Math.log10(high) + 1e-9);
        const skip = Math.max(1, Math.ceil((last - first + 1) / 6));
        return Array.from({length: last - first + 1}, (_, k) => 10 ** (first + k)).filter(
          (_, k) => k % skip === 0,
        );
      },
      values: (u, splits) =>
        splits.map(value => {
          const power = Math.round(Math.log10(value));
          return power >= 0 && power < 4 ? String(10 ** power) : `10${raised(power)}`;
        }),
    };
    this.place.append(made('p', unit, 'unit'));
    const options = {
      height: 11 * rem(),
      legend: {show: false},
      cursor: {show: false},
      padding: [8, 1.1 * rem(), 0, 0],
      scales: {x: {time: false, distr: 3}, y: {distr: 3}},
      series: [{}, {stroke: colour('law'), width: 1.2, points: {show: false}}],
      axes: [
        axis(true, {...decade, grid: {show: true, stroke: colour('line'), width: 1}}),
        axis(false, {...decade, size: 3.4 * 0.76 * rem()}),
      ],
    };
    this.plot = grown(this.place, options, [
      [1, 10],
      [1, 1],
    ]);
    this.place.append(made('p', 'frequency, Hz', 'unit under'));
  }

  remove() {
    this.plot?.stopWatching();
    this.plot?.destroy();
    this.plot = null;
    this.place.replaceChildren();
  }
}

function drawEvents(events) {
  one('no-events').hidden = events.length > 0;
  one('events').replaceChildren(
    ...events
      .slice(-30)
      .reverse()
      .map(({at, kind, text, source}) => {
        const item = made('li', '', kind === 'trouble' ? 'far' : kind === 'over' ? 'fine' : 'soft');
        item.append(made('b', seconds(at)), made('span', (kind === 'over' ? 'over: ' : '') + text));
        item.title = `${source}: ${kind}`;
        return item;
      }),
  );
}

function drawDiagnosis({running, stage, progress, sentence, problem, number}) {
  one('diagnose').disabled = running;
  one('cancel').hidden = one('job').hidden = !running;
  one('progress').value = progress;
  one('stage').textContent = stage;
  const answer = one('answer');
  answer.hidden = running || !(sentence || problem);
  answer.className = problem ? 'refused' : '';
  answer.replaceChildren(made('span', problem || sentence));
  if (number) {
    const link = made('a', 'the answer');
    link.href = `/answers/${number}`;
    link.target = '_blank';
    link.rel = 'noopener';
    answer.append(' ', link);
  }
}
