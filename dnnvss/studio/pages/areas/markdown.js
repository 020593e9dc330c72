// Markdown as this package writes it: headings, paragraphs, lists and tables. Everything in it is text.

const made = (name, text) => { const own = document.createElement(name); if (text !== undefined) own.append(...inline(text)); return own; };

// Bold, and what was escaped for a table.
function inline(text) {
  return text.split(/(\*\*.+?\*\*)/).map(part => {
    const plain = part.replaceAll('\\|', '|').replaceAll('&lt;', '<');
    if (!/^\*\*.+\*\*$/.test(part)) return plain;
    const strong = document.createElement('strong');
    strong.textContent = plain.slice(2, -2);
    return strong;
  });
}

const cells = line => line.trim().replace(/^\||\|$/g, '').split(/(?<!\\)\|/).map(cell => cell.trim());

function table(lines) {
  const own = made('table'), head = made('thead'), body = made('tbody');
  const row = (line, kind) => { const made_ = made('tr'); made_.append(...cells(line).map(cell => made(kind, cell))); return made_; };
  head.append(row(lines[0], 'th'));
  body.append(...lines.slice(/^[\s|:-]+$/.test(lines[1] || '') ? 2 : 1).map(line => row(line, 'td')));
  own.append(head, body);
  const scroll = made('div');
  Object.assign(scroll, {className: 'scroll', tabIndex: 0});
  scroll.setAttribute('role', 'region'); scroll.setAttribute('aria-label', `Table: ${cells(lines[0]).join(', ')}`);
  scroll.append(own);
  return scroll;
}

function block(lines) {
  const heading = /^(#{1,4}) (.*)/.exec(lines[0]);
  if (heading) return [made(heading[1].length > 2 ? 'h3' : 'h2', heading[2]), ...(lines.length > 1 ? block(lines.slice(1)) : [])];
  if (lines[0].startsWith('|')) return [table(lines)];
  const kind = /^- /.test(lines[0]) ? 'ul' : /^\d+\. /.test(lines[0]) ? 'ol' : null;
  if (!kind) return [made('p', lines.join(' '))];
  const own = made(kind);
  own.append(...lines.map(line => made('li', line.replace(/^(- |\d+\. )/, ''))));
  return [own];
}

export const markdown = text => text.split(/\n\s*\n/).map(part => part.split('\n').filter(line => line.trim())).filter(lines => lines.length).flatMap(block);
