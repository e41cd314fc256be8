/* The curve of a missing effect with its band, over what was measured. */
'use strict';

/*
 * A curve with its band over measured points: {curve, points} of one missing effect. While nobody
 * points at it the legend reads its right end.
 */
function curvePlot(place, {curve, points}) {
  const order = curve.x.map((_, k) => k).sort((a, b) => curve.x[a] - curve.x[b]);
  const sorted = list => order.map(k => list[k]);
  const banded = curve.low?.length === curve.x.length && curve.high?.length === curve.x.length;
  const dots = points?.x?.length ? points : {x: [], y: []};
  const inner = dots.y.filter(value => value !== null).sort((a, b) => a - b);
  const edges = inner.length
    ? [inner[Math.floor(0.005 * inner.length)], inner[Math.ceil(0.995 * inner.length) - 1]]
    : [];
  const heights = [...curve.y, ...(banded ? [...curve.low, ...curve.high] : []), ...edges].filter(
    v => v !== null,
  );
  const across = shownUnit(curve.unit, largest(curve.x)),
    up = shownUnit(curve.y_unit, largest(heights));
  if (up.unit) place.closest('figure').querySelector('[data-height]').textContent = up.unit;
  const scaled = (list, factor) => list.map(value => (value === null ? null : value / factor));
  const wide = [...curve.x, ...dots.x].filter(v => v !== null);
  const ends = [Math.min(...wide) / across.factor, Math.max(...wide) / across.factor];
  const range = roomy(Math.min(...heights) / up.factor, Math.max(...heights) / up.factor);
  const resting = unit => (u, value, series, k) =>
    read(unit)(u, k === null ? u.data[series].at(-1) : value);
  const line = (label, name, width) => ({
    label,
    stroke: colour(name),
    width,
    points: {show: false},
    value: resting(up.unit),
  });
  const dotted = colour('twin', 60);
  const drawDots = u => {
    const {ctx} = u,
      {left, top, width, height} = u.bbox,
      size = Math.max(1.5, 2 * devicePixelRatio);
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    ctx.fillStyle = dotted;
    dots.x.forEach((x, k) => {
      if (dots.y[k] !== null && x !== null)
        ctx.fillRect(
          u.valToPos(x / across.factor, 'x', true) - size / 2,
          u.valToPos(dots.y[k] / up.factor, 'y', true) - size / 2,
          size,
          size,
        );
    });
    ctx.restore();
  };
  const font = 0.76 * rem();
  return grown(
    place,
    {
      height: Math.round(17 * rem()),
      padding: [8, 14, 0, 0],
      cursor: {y: false, drag: {x: false, y: false}},
      scales: {
        x: {time: false, range: () => (ends[1] > ends[0] ? ends : [ends[0] - 1, ends[0] + 1])},
        y: {range: () => range},
      },
      axes: [
        axis(true, {
          label: `${spoken(curve.variable || '')}${across.unit ? ', ' + across.unit : ''}`,
          labelSize: 1.7 * font,
          labelFont: `${font}px ${getComputedStyle(document.body).fontFamily}`,
        }),
        axis(false),
      ],
      series: [
        {label: spoken(curve.variable || 'x'), value: resting(across.unit)},
        line('curve', 'law', 2),
        ...(banded
          ? [
              {...line('band from', 'augmented', 0.8), dash: [4, 3]},
              {...line('to', 'augmented', 0.8), dash: [4, 3]},
            ]
          : []),
      ],
      bands: banded ? [{series: [3, 2], fill: colour('augmented', 25)}] : [],
      hooks: {drawAxes: [drawDots]},
    },
    [
      scaled(sorted(curve.x), across.factor),
      scaled(sorted(curve.y), up.factor),
      ...(banded
        ? [scaled(sorted(curve.low), up.factor), scaled(sorted(curve.high), up.factor)]
        : []),
    ],
  );
}
