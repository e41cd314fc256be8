/* The connection to the server, opened again whenever it is gone, and the samples that came. */
'use strict';

const RETRIES = [300, 600, 1200, 2000]; // ms

/* Opens a WebSocket, and another one when it ends; says facts, samples and its own state. */
class Link {
  constructor(heard) {
    this.heard = heard;
    this.tries = 0;
    this.open();
  }

  open() {
    const socket = (this.socket = new WebSocket(`ws://${location.host}/socket`));
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({data}) => {
      this.tries = 0;
      if (typeof data === 'string') this.heard.told(JSON.parse(data));
      else this.heard.samples(unpackedSamples(data));
    };
    socket.onclose = () => {
      this.heard.gone();
      setTimeout(() => this.open(), RETRIES[Math.min(this.tries++, RETRIES.length - 1)]);
    };
  }

  say(request) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(request));
  }
}

function unpackedSamples(buffer) {
  const size = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  return {...head, values: new Float32Array(buffer, 4 + size)};
}

/* The newest buckets of each name: the smallest and the largest sample of a stretch of time. */
class Buckets {
  constructor() {
    this.step = this.first = this.count = 0;
    this.bands = new Map();
  }

  get end() {
    return (this.first + this.count) * this.step;
  }

  /* Takes a message; whatever does not join what is here begins again. */
  take({whole, first, bucket, period, names, count, values}, span) {
    if (whole || first !== this.first + this.count) {
      this.step = bucket * period;
      this.first = first;
      this.count = 0;
      this.bands = new Map(names.map(name => [name, {low: [], high: []}]));
    }
    names.forEach((name, k) => {
      const band = this.bands.get(name);
      for (let i = 0; i < count; i++) {
        const low = values[2 * k * count + i],
          high = values[(2 * k + 1) * count + i];
        band.low.push(low === low ? low : null);
        band.high.push(high === high ? high : null);
      }
    });
    this.count += count;
    const surplus = this.count - Math.ceil(span / this.step) - 8;
    if (surplus > 256) {
      for (const band of this.bands.values()) {
        band.low.splice(0, surplus);
        band.high.splice(0, surplus);
      }
      this.first += surplus;
      this.count -= surplus;
    }
  }

  /* Two instants of each bucket, at which its two ends are drawn. */
  times() {
    const times = new Array(2 * this.count);
    for (let k = 0; k < this.count; k++) {
      times[2 * k] = (this.first + k + 0.25) * this.step;
      times[2 * k + 1] = (this.first + k + 0.75) * this.step;
    }
    return times;
  }

  line(name) {
    const band = this.bands.get(name);
    const line = new Array(2 * this.count);
    if (!band) return line.fill(null);
    for (let k = 0; k < this.count; k++) {
      line[2 * k] = band.low[k];
      line[2 * k + 1] = band.high[k];
    }
    return line;
  }

  known(name) {
    return this.bands.get(name)?.low.some(value => value !== null) ?? false;
  }
}
