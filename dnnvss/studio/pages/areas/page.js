// An area: a list of what there is, and one thing of it at a time. What is shown stands in the address behind #.

import {get} from '/api.js';
import {showFit} from './fit.js';
import {markdown} from './markdown.js';

const AGAIN = 4000;  // milliseconds
const $ = id => document.getElementById(id);
const made = (name, text = '', about = {}) => Object.assign(document.createElement(name), {textContent: text, ...about});
let listed = null, stop = new AbortController();

function say(text, bad = false) { $('said').textContent = text; $('said').classList.toggle('bad', bad); }
const guarded = work => (...given) => Promise.resolve(work(...given)).catch(error => { if (error.name !== 'AbortError') say(error.message, true); });
const address = (item, link) => `#${encodeURIComponent(item.name)}/${link.path.split('/').map(encodeURIComponent).join('/')}`;
const place = (item, path) => `${encodeURIComponent(item.name)}/${path.split('/').map(encodeURIComponent).join('/')}`;

// ---- the list ------------------------------------------------------------------------------------------------------

function card(item) {
  const own = made('li', '', {className: 'item'}), title = made('h2', item.title);
  if (item.state) title.append(made('span', item.state, {className: `state ${item.state}`}));
  const facts = made('dl');
  for (const [what, value] of Object.entries(item.facts)) facts.append(made('dt', what), made('dd', value));
  const links = made('div', '', {className: 'row'});
  for (const link of item.links) links.append(made('a', link.title, {href: address(item, link), ariaLabel: `${link.title}: ${item.title}`}));
  own.append(title, ...(item.wrong ? [made('p', item.wrong, {className: 'bad'})] : []), facts, links, made('p', item.folder, {className: 'quiet'}));
  return own;
}

function list() {
  $('title').textContent = listed.title; $('about').textContent = listed.about;
  $('items').replaceChildren(...listed.items.map(card));
  if (!listed.items.length) $('items').append(made('li', 'Nothing is here yet. The commands below make something.', {className: 'item'}));
  $('commands').replaceChildren(...listed.begin.flatMap(({about, command}) => [made('dt', about), shell(command)]));
  $('folders').textContent = `Looked for in: ${listed.folders.join(', ')}`;
}

function shell(command) {
  const own = made('dd'), copy = made('button', 'Copy', {type: 'button', ariaLabel: `Copy: ${command}`});
  copy.addEventListener('click', guarded(async () => { await navigator.clipboard.writeText(command); say('copied'); }));
  own.append(made('code', command), copy);
  return own;
}

// ---- one thing -----------------------------------------------------------------------------------------------------

const kinds = {
  page(item, link) {
    const frame = made('iframe', '', {src: place(item, link.path), title: `${link.title}: ${item.title}`});
    frame.addEventListener('load', () => frame.contentWindow.focus());
    $('shown').append(frame);
  },
  async text(item, link) {
    const answer = await fetch(place(item, link.path), {signal: stop.signal});
    if (!answer.ok) throw new Error((await answer.json()).error);
    $('shown').append(...markdown(await answer.text()));
  },
  film(item, link) {
    const video = made('video', '', {src: place(item, link.path), controls: true, ariaLabel: `${link.title}: ${item.title}`});
    $('shown').append(video);
    video.focus();
  },
  fit: (item, link) => showFit($('shown'), place(item, ''), link.path, stop.signal),
};

// The list is asked for again: what commands make meanwhile comes by itself.
function again() {
  const {signal} = stop;
  setTimeout(guarded(async () => {
    if (signal.aborted) return;
    const found = await get('items');
    if (signal.aborted) return;
    if (JSON.stringify(found) !== JSON.stringify(listed) && !$('items').contains(document.activeElement)) { listed = found; list(); }
    again();
  }), AGAIN);
}

const route = guarded(async () => {
  stop.abort(); stop = new AbortController();
  say('');
  const [name, ...rest] = location.hash.slice(1).split('/').map(decodeURIComponent);
  if (!listed || !name) listed = await get('items');
  const item = listed.items.find(each => each.name === name), link = item?.links.find(each => each.path === rest.join('/'));
  $('list').hidden = Boolean(link); $('view').hidden = !link;
  $('shown').replaceChildren(); $('shown').className = link && link.kind !== 'page' ? 'text' : '';
  document.title = `${link ? `${item.title}, ` : ''}${listed.title}: dnnvss studio`;
  if (!link) {
    list();
    if (name) say('it is not there any more', true); else again();
    return;
  }
  $('what').textContent = item.title;
  $('links').hidden = item.links.length < 2;
  $('links').replaceChildren(...item.links.map(each => {
    const own = made('a', each.title, {href: address(item, each)});
    if (each === link) own.setAttribute('aria-current', 'true');
    return own;
  }));
  $('view').focus();
  await kinds[link.kind](item, link);
});

addEventListener('hashchange', route);
route();
