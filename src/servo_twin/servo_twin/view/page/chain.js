/* The chain from command to sensors, coloured by the residual of each balance. */
'use strict';

const CHAIN = [
  ['controller', 'controller'],
  ['drive', 'drive'],
  ['motor', 'motor'],
  ['transmission', 'transmission'],
  ['load', 'load'],
  ['sensors', 'sensor'],
];
/* Without a torque sensor, what acts on either shaft cannot be told apart. */
const WITHOUT_TORQUE = [
  ...CHAIN.slice(0, 2),
  ['motor, load', 'torque_balance'],
  CHAIN[3],
  CHAIN[5],
];

const tone = level =>
  level === undefined ? 'unseen' : level < 2 ? 'fine' : level < 10 ? 'off' : 'far';
const timesNoise = level =>
  level === undefined
    ? 'not observable'
    : `${level < 999.5 ? +level.toPrecision(3) : Math.round(level)} × noise`;

function drawChain(levels) {
  const chain = 'torque_balance' in levels ? WITHOUT_TORQUE : CHAIN;
  const list = document.getElementById('chain');
  if (list.children.length !== chain.length)
    list.replaceChildren(
      ...chain.map(([block]) => {
        const item = document.createElement('li');
        item.innerHTML = '<div class="block"><b></b><span></span></div>';
        item.querySelector('b').textContent = block;
        return item;
      }),
    );
  chain.forEach(([, balance], k) => {
    list.children[k].className = tone(levels[balance]);
    list.children[k].querySelector('span').textContent = timesNoise(levels[balance]);
  });
}
