// The service under the page: every call answers with what it gives, or throws what is wrong in words.

async function checked(response) {
  if (response.ok) return response;
  let said = `the server answered ${response.status}`;
  try { said = (await response.json()).error || said; } catch { /* no words came with it */ }
  throw new Error(said);
}

async function reached(path, given) {
  const answer = fetch(path, given).catch(error => {
    throw error.name === 'AbortError' ? error : new Error('The studio does not answer. Is it still running?');
  });
  return checked(await answer);
}

export const get = async path => (await reached(path)).json();
export const bytes = async (path, signal) => (await reached(path, {signal})).arrayBuffer();
export const post = async (path, body, signal) => (await reached(path, {
  method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(body), signal})).json();
export const send = async (path, data) => (await reached(path, {
  method: 'POST', headers: {'Content-Type': 'application/octet-stream'}, body: data})).json();
