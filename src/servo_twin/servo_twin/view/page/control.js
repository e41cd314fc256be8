/* What may be changed: values of the twin as sliders, faults of an emulated rig as switches. */
'use strict';

const HOLDS = 1500; // ms for which what was moved here is not overwritten by what was before

/* A slider over a range: logarithmic where the range is wide, else about the value. */
function scaleOf({value, low, high}) {
  const size = Math.abs(value) || Math.min(1, high - low);
  const from = Math.max(low, value < 0 ? 4 * value : low > 0 || value > 0 ? 0 : -size),
    to = Math.min(high, value < 0 ? (high > 0 ? size : 0) : 4 * size);
  if (low > 0 && high / low > 1e3 && value > 0) {
    const [a, b] = [Math.log(Math.max(low, value / 10)), Math.log(Math.min(high, value * 10))];
    return {to: share => Math.exp(a + share * (b - a)), from: v => (Math.log(v) - a) / (b - a)};
  }
  const [a, b] = high - low <= 20 * size ? [low, high] : [Math.max(low, from), Math.max(to, from)];
  return {to: share => a + share * (b - a), from: v => (v - a) / (b - a || 1)};
}

/* One value with its slider and its number; what is being moved is not overwritten. */
class Value {
  constructor(entry, control, set) {
    this.entry = entry;
    this.scale = scaleOf(entry);
    this.moved = -Infinity;
    this.latest = entry.value;
    const name = entry.path.slice(entry.path.lastIndexOf('.') + 1);
    this.row = made('div', '', 'value');
    this.slider = Object.assign(made('input'), {
      type: 'range',
      min: 0,
      max: 1,
      step: 0.001,
      disabled: !control,
    });
    this.number = Object.assign(made('input'), {type: 'number', step: 'any', disabled: !control});
    for (const input of [this.slider, this.number]) input.setAttribute('aria-label', entry.path);
    this.row.title = `${entry.path}: ${entry.meaning} Range ${digits(entry.low)} to ${digits(entry.high)}.`;
    this.row.dataset.path = entry.path;
    this.row.append(
      made('span', spoken(name), 'name'),
      this.number,
      made('span', pretty(entry.unit), 'unit'),
      this.slider,
    );
    this.slider.oninput = () => {
      const value = +this.scale.to(+this.slider.value).toPrecision(4);
      this.moved = performance.now();
      this.number.value = value;
      this.later ??= setTimeout(() => {
        this.later = null;
        set(entry.path, +this.number.value);
      }, 100);
    };
    this.number.onchange = () => {
      this.moved = performance.now();
      if (this.number.value !== '') set(entry.path, +this.number.value);
    };
    this.number.onblur = () => this.show(this.latest);
    this.show(entry.value);
  }

  show(value) {
    this.latest = value;
    const held = HOLDS - (performance.now() - this.moved);
    if (held > 0) {
      clearTimeout(this.waiting);
      this.waiting = setTimeout(() => this.show(this.latest), held + 1);
    }
    if (held > 0 || document.activeElement === this.number) return;
    this.number.value = +value.toPrecision(6);
    this.slider.value = Math.min(1, Math.max(0, this.scale.from(value)));
  }
}

/* All values of the servo, a group for each part of it. */
class Values {
  constructor(place, control, set) {
    Object.assign(this, {place, control, set, rows: new Map(), shape: ''});
  }

  draw(entries) {
    const shape = entries.map(entry => entry.path).join();
    if (shape !== this.shape) {
      this.shape = shape;
      this.rows = new Map();
      const groups = new Map();
      for (const entry of entries) {
        const part = entry.path.slice(0, entry.path.lastIndexOf('.'));
        if (!groups.has(part)) {
          const group = made('details');
          group.append(made('summary', spoken(part.replace('effects.', '').replaceAll('.', ', '))));
          group.open = groups.size < 1;
          groups.set(part, group);
        }
        const row = new Value(entry, this.control, this.set);
        this.rows.set(entry.path, row);
        groups.get(part).append(row.row);
      }
      this.place.replaceChildren(...groups.values());
    }
    for (const entry of entries) this.rows.get(entry.path).show(entry.value);
  }
}

/* The faults of an emulated rig, a switch for each. */
class Faults {
  constructor(place, set) {
    Object.assign(this, {place, set, rows: new Map(), moved: -Infinity});
  }

  draw(facts) {
    if (!facts) {
      this.rows.clear();
      this.place.replaceChildren(made('p', 'The emulated rig does not answer.', 'note'));
      return;
    }
    if (!facts.faults.length)
      this.place.replaceChildren(made('p', `${facts.rig} has none that can be injected.`, 'note'));
    else if (this.rows.size !== facts.faults.length) this.make(facts.faults);
    this.latest = facts;
    const held = HOLDS - (performance.now() - this.moved);
    clearTimeout(this.waiting);
    if (held > 0) {
      this.waiting = setTimeout(() => this.draw(this.latest), held + 1);
      return;
    }
    for (const {path, value} of facts.faults) {
      const row = this.rows.get(path);
      row.box.checked = value !== 0;
      if (value !== 0 && document.activeElement !== row.strength) row.strength.value = value;
    }
  }

  make(faults) {
    this.rows.clear();
    this.place.replaceChildren(
      ...faults.map(({path, unit, strength, meaning, value}) => {
        const line = made('div', '', 'fault'),
          label = made('label');
        const box = Object.assign(made('input'), {type: 'checkbox'});
        box.setAttribute('role', 'switch');
        const number = Object.assign(made('input'), {
          type: 'number',
          step: 'any',
          value: value || strength,
        });
        number.setAttribute('aria-label', `strength of ${path}`);
        const row = {box, strength: number};
        const tell = () => {
          this.moved = performance.now();
          this.set(path, box.checked ? +number.value : 0);
        };
        box.onchange = tell;
        number.onchange = () => box.checked && tell();
        line.title = `${path}: ${meaning}`;
        line.dataset.path = path;
        label.append(box, made('span', spoken(path.slice(path.indexOf('.') + 1))));
        line.append(label, number, made('span', pretty(unit.replaceAll('^', '')), 'unit'));
        this.rows.set(path, row);
        return line;
      }),
    );
  }
}
