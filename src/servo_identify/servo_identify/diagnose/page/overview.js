/* The whole recording, small, with the window in it. */
'use strict';

function drawOverview() {
  if (overview) {
    overview.stopWatching();
    overview.destroy();
    overview = null;
  }
  const series = seriesOf(state.recording),
    entry = equationsOf(state.recording)[0];
  const values =
    Object.entries(series?.channels || {}).find(
      ([name, c]) => state.channels.has(name) && c.rig?.length,
    )?.[1].rig || entry?.before;
  if (!values) return;
  overview = grown(
    one('overview'),
    {
      height: Math.round(4.6 * rem()),
      padding: [4, 16, 0, 0],
      legend: {show: false},
      cursor: {...mouse(), x: false, points: {show: false}},
      scales: {
        x: {time: false, range: () => state.whole},
        y: {range: (u, low, high) => roomy(low, high)},
      },
      axes: [
        axis(true, {values: (u, splits) => labels(splits).map(label => `${label} s`)}),
        axis(false, {values: (u, splits) => splits.map(() => ''), splits: () => []}),
      ],
      series: [{}, {stroke: colour('rig'), width: 1, points: {show: false}}],
      hooks: {setSelect: [dragged], setSize: [markOverview]},
    },
    [series?.channels && values !== entry?.before ? series.t : entry.t, values],
  );
  markOverview();
}

function markOverview() {
  if (!overview) return;
  const [left, right] = state.window.map(t => overview.valToPos(t, 'x'));
  overview.setSelect(
    {left, width: Math.max(2, right - left), top: 0, height: overview.over.clientHeight},
    false,
  );
}
