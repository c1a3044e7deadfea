var b=class extends Error{constructor(e,t){super(t),this.code=e}};function v(o,e){let t=o.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function u(o,e={},...t){let n=document.createElement(o);for(let[s,i]of Object.entries(e))s in n?Reflect.set(n,s,i):n.setAttribute(s,i);return n.append(...t),n}var O=()=>matchMedia("(prefers-reduced-motion: reduce)").matches;function N(o){let e=new CSSStyleSheet;e.replaceSync(o),document.adoptedStyleSheets=[...document.adoptedStyleSheets,e]}var y=(o,e)=>Array.isArray(o)&&o.length===e&&o.every(Number.isFinite);function R(o){if(!(Array.isArray(o?.languages)&&o.languages.every(t=>typeof t=="string")&&Array.isArray(o.labels)&&Array.isArray(o.stops)&&o.labels.every(t=>typeof t?.id=="string"&&y(t.marker,3)&&y(t.box,6)&&Number.isInteger(t.cell))&&o.stops.every(t=>y(t?.position,3)&&y(t.direction,3)&&(t.label===void 0||t.label in o.labels))))throw new b("PTM-V105","The tour is damaged.");return o}function P(o,e){let t=n=>n.toLowerCase().split("-")[0];for(let n of e){let i=o.find(r=>r.toLowerCase()===n.toLowerCase())??o.find(r=>t(r)===t(n));if(i)return i}return o[0]??"en"}function C(o,e,t){if(!o||typeof o!="object")return null;let n=[e,"",t,...Object.keys(o)].find(s=>Object.hasOwn(o,s));return n===void 0?null:{text:o[n],tag:n}}var F={p:"p",h:"h3",em:"em",strong:"strong",code:"code",ul:"ul",ol:"ol",li:"li",quote:"blockquote",br:"br"},B=/^(https?|mailto):/i,j=32,A=o=>B.test(o);function w(o,e=0){return!Array.isArray(o)||e>j?[]:o.map(t=>{if(!Array.isArray(t))return String(t);let[n,...s]=t;if(n==="a"){let[r,...l]=s,a=w(l,e+1);return A(String(r))?u("a",{href:String(r),target:"_blank",rel:"noopener"},...a):u("span",{},...a)}let i=Object.hasOwn(F,n)?F[n]:"span";return u(i,{},...w(s,e+1))})}var I=(o,e,t={})=>e?[u(o,{...t,lang:e.tag,dir:"auto"},String(e.text))]:[];function _(o,e,{choose:t,urlOf:n,close:s,ways:i}){let r=t(e.title)??{text:e.id,tag:""},l=t(e.maker),a=t(e.date),c=[l,a].filter(p=>p!==null),h=t(e.text),m=t(e.image),f=t(e.link),d=u("h2",{tabIndex:-1,lang:r.tag,dir:"auto"},String(r.text));o.replaceChildren(u("button",{className:"close",ariaLabel:"Close",onclick:s},"×"),d,...c.length?[u("p",{className:"by"},...H(c))]:[],...h?[u("div",{lang:h.tag,dir:"auto"},...w(h.text))]:[],...Q(e,t,n),...m?[u("details",{},u("summary",{},"Description of the picture"),...I("p",m))]:[],...f&&A(f.text)?[u("p",{},u("a",{href:f.text,target:"_blank",rel:"noopener"},"More about it"))]:[],u("p",{className:"row"},...i.map(({text:p,go:g})=>u("button",{onclick:g},p)))),d.focus({preventScroll:!0}),o.scrollTop=0}var H=o=>o.flatMap((e,t)=>[...t?[", "]:[],...I("span",e)]);function Q(o,e,t){let n=e(o.sound),s=e(o.captions);if(!n)return[];let i=u("audio",{controls:!0,preload:"none",src:t(String(n.text))});if(!s)return[i];let r=u("track",{kind:"captions",default:!0,srclang:s.tag||"und"}),l=u("p",{className:"captions",lang:s.tag,dir:"auto"});return i.onplay=()=>{r.src||(r.src=t(String(s.text))),r.track.mode="hidden"},r.track.oncuechange=()=>{let a=[...r.track.activeCues??[]];l.textContent=a.map(c=>c.getCueAsHTML().textContent).join(`
`)},i.append(r),[i,l]}var M=(o="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${o}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,X=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,G=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${X}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,z=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,K=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${z}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,W=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${z}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,U={surface:[M(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),G],item:[M(),K],placeholder:[M(),W]};function $(o,e,t=U[e]){let n=o.createProgram(),s=[o.VERTEX_SHADER,o.FRAGMENT_SHADER];if(t.forEach((l,a)=>{let c=o.createShader(s[a]);o.shaderSource(c,l),o.compileShader(c),o.attachShader(n,c),o.deleteShader(c)}),o.linkProgram(n),!o.getProgramParameter(n,o.LINK_STATUS)&&!o.isContextLost())throw new Error(`${e}: ${o.getProgramInfoLog(n)}`);let i={},r=o.isContextLost()?0:o.getProgramParameter(n,o.ACTIVE_UNIFORMS);for(let l=0;l<r;l++){let a=o.getActiveUniform(n,l)?.name??"";i[a]=o.getUniformLocation(n,a)}return{program:n,at:i}}function q(o,{program:e,at:t},n){o.useProgram(e),o.uniform3fv(t.eye,n.eye),o.uniformMatrix3fv(t.turn,!1,n.turn),o.uniform4fv(t.lens,n.lens)}function L({eye:o,yaw:e,pitch:t},n,s,i){let[r,l,a,c]=[Math.sin(e),Math.cos(e),Math.sin(t),Math.cos(t)],h=[l,r*a,r*c,0,c,-a,-r,l*a,l*c],m=1/Math.tan(n/2),f=.1-i;return{eye:o,turn:h,lens:[m/s,m,(i+.1)/f,2*i*.1/f]}}var J=15,Z=24,tt=.03,D=.15,k=8,et=`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
uniform vec3 point;
void main(){
vec3 seen=turn*(point-eye);
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
gl_PointSize=1.0;
}`,nt=`#version 300 es
precision mediump float;
out vec4 shown;
void main() { shown = vec4(0.0); }`,S=class{#e=[];#n=[];#o=null;#i=null;#t=new Map;current=-1;constructor(e,t,{nameOf:n,open:s}){this.walk=e,this.labels=t,this.nameOf=n,this.open=s,this.root=u("div",{id:"markers"}),e.canvas.after(this.root),e.probe=i=>this.#a(i),e.canvas.addEventListener("webglcontextlost",()=>{this.#o=null,this.#n=[]})}get shown(){return[...this.#t.keys()]}#s(e){let t=new Set(this.walk.visible);return this.labels.map(({marker:n,cell:s},i)=>{let r=Math.hypot(...n.map((l,a)=>l-e[a]));return{label:i,away:s<0||t.has(s)?r:1/0}}).filter(({away:n})=>n<J).sort((n,s)=>n.away-s.away).slice(0,Z)}#a(e){let{gl:t}=this.walk;if(this.#r(),!this.#n.length){this.#o??=$(t,"markers",[et,nt]),this.#i??=t.createVertexArray(),q(t,this.#o,e),t.bindVertexArray(this.#i),t.colorMask(!1,!1,!1,!1),t.depthMask(!1);for(let{label:n,away:s}of this.#s(e.eye)){let i=t.createQuery();if(!i)break;let r=Math.max(0,1-tt-D/Math.max(s,D)),l=this.labels[n].marker.map((a,c)=>e.eye[c]+(a-e.eye[c])*r);t.uniform3fv(this.#o.at.point,l),t.beginQuery(t.ANY_SAMPLES_PASSED_CONSERVATIVE,i),t.drawArrays(t.POINTS,0,1),t.endQuery(t.ANY_SAMPLES_PASSED_CONSERVATIVE),this.#n.push({label:n,query:i})}t.colorMask(!0,!0,!0,!0),t.depthMask(!0)}}#r(){let{gl:e}=this.walk,t=this.#n,n=t.at(-1);if(!(!n||!e.getQueryParameter(n.query,e.QUERY_RESULT_AVAILABLE))){this.#e=[];for(let{label:s,query:i}of t)this.#e[s]=!!e.getQueryParameter(i,e.QUERY_RESULT),e.deleteQuery(i);this.#n=[]}}place(e){let{walk:t}=this,{clientWidth:n,clientHeight:s}=t.canvas;this.#r();let{eye:i,turn:r,lens:l}=L(e,t.tall,t.aspect,t.far),a=new Map;for(let{label:c}of this.#s(i)){if(!this.#e[c])continue;let[h,m,f]=this.labels[c].marker.map((x,Y)=>x-i[Y]),d=[0,1,2].map(x=>r[x]*h+r[x+3]*m+r[x+6]*f);if(d[2]>=0)continue;let p=(.5-d[0]*l[0]/d[2]/2)*n,g=(.5+d[1]*l[1]/d[2]/2)*s;if(p<-k||g<-k||p>n+k||g>s+k)continue;let E=this.#t.get(c)??this.#l(c);E.style.transform=`translate(${p.toFixed(1)}px,${g.toFixed(1)}px)`,E.toggleAttribute("aria-current",c===this.current),a.set(c,E)}for(let[c,h]of this.#t)a.has(c)||(h===document.activeElement?a.set(c,h):h.remove());this.#t=a}#l(e){let t=this.nameOf(e),n=u("button",{title:t,ariaLabel:t});return n.onclick=()=>this.open(e),this.root.append(n),n}rename(){for(let[e,t]of this.#t)t.title=t.ariaLabel=this.nameOf(e)}at(e,t,n){let{walk:s}=this,{clientWidth:i,clientHeight:r}=s.canvas,{eye:l,turn:a,lens:c}=L(e,s.tall,s.aspect,s.far),h=[(2*t/i-1)/c[0],(1-2*n/r)/c[1],-1],m=[0,1,2].map(p=>a[3*p]*h[0]+a[3*p+1]*h[1]+a[3*p+2]*h[2]),f=-1,d=1/0;for(let{label:p}of this.#s(l)){if(!this.#e[p])continue;let g=ot(l,m,this.labels[p].box);g<d&&([f,d]=[p,g])}return f}};function ot(o,e,t){let n=0,s=1/0;for(let i=0;i<3;i++){let r=(t[i]-o[i])/e[i],l=(t[i+3]-o[i])/e[i];n=Math.max(n,Math.min(r,l)||n),s=Math.min(s,Number.isNaN(Math.max(r,l))?s:Math.max(r,l))}return n<=s?n:1/0}var V=`
#markers { position: fixed; inset: 0; pointer-events: none; overflow: hidden; }
#markers button { position: absolute; left: 0; top: 0; width: 44px; min-height: 44px; height: 44px; margin: -22px; padding: 0; border: 0; border-radius: 50%; background: none; pointer-events: auto; }
#markers button::before { content: ""; position: absolute; inset: 11px; border: 2px solid #16171b; border-radius: 50%; background: var(--ink); box-shadow: 0 0 0 2px #fffc, 0 2px 8px #000a; }
#markers button:hover::before, #markers button:focus-visible::before, #markers [aria-current]::before { background: var(--warm); inset: 8px; }
#markers button:focus-visible { outline-offset: -2px; }
#tour, #label { margin-left: auto; }
#tour ol { list-style: none; margin: 0; padding: 0; display: grid; gap: 6px; }
#tour li button { width: 100%; text-align: start; padding: 8px 12px; background: #ffffff0d; }
#tour li small { display: block; color: var(--dim); font-size: 13px; }
#tour [aria-current] { border-color: var(--warm); }
#tour select { width: 100%; margin: 0 0 10px; }
#label h2 { font-size: 20px; line-height: 1.25; margin: 0 44px 4px 0; }
#label h3 { color: inherit; font-size: 15px; }
#label .by { color: var(--dim); margin: 0 0 10px; }
#label p, #label li { max-width: 65ch; }
#label blockquote { margin: 8px 0; padding-inline-start: 12px; border-inline-start: 3px solid var(--line); }
#label audio { width: 100%; margin: 8px 0 0; }
#label .captions { min-height: 3em; margin: 6px 0 0; padding: 8px 10px; background: #000; border-radius: 8px; }
#label .captions:empty { display: none; }
#label .close { float: right; width: 44px; padding: 0; margin: -4px -6px 0 0; }
#label details summary { min-height: 32px; cursor: pointer; color: var(--dim); }
@media (forced-colors: active) { #markers button::before { border-color: CanvasText; forced-color-adjust: none; } }
`;var it=6,st=500;async function rt(o,e){let t=new URL(e,document.baseURI).href;try{let n=await o.walk.fetcher.whole(t,s=>R(JSON.parse(new TextDecoder().decode(s))));return N(V),new T(o,n,t)}catch(n){let s=n instanceof b?n.code:"PTM-V105";return o.walk.faults.push({code:s,message:String(n)}),o.emit("notice",{message:"The labels of the tour could not be loaded."}),null}}var T=class{open=-1;stop=-1;#e=null;constructor(e,t,n){this.app=e,this.tour=t,this.url=n;let s=new URLSearchParams(location.search),i=s.get("lang");this.language=P(t.languages,[...i?[i]:[],...navigator.languages]),this.panel=u("section",{id:"label",ariaLabel:"Label",hidden:!0}),this.list=u("section",{id:"tour",ariaLabel:"Tour",tabIndex:0,hidden:!0}),v(document,"#panels").append(this.list,this.panel),this.button=u("button",{"aria-controls":"tour","aria-expanded":"false"},"Tour"),this.button.onclick=()=>this.#t(this.list.hidden),v(document,"nav").prepend(this.button),this.markers=new S(e.walk,t.labels,{nameOf:a=>this.nameOf(a),open:a=>this.show(a)}),this.#i(),this.#o();let r=t.labels.findIndex(({id:a})=>a===s.get("label")),l=s.get("stop")??"";r>=0?this.visit(r):/^\d+$/.test(l)&&Number(l)in t.stops&&this.go(Number(l))}choose=e=>C(e,this.language,this.tour.languages[0]);nameOf(e){let{id:t,title:n,maker:s}=this.tour.labels[e];return[this.choose(n)?.text??t,this.choose(s)?.text].filter(Boolean).join(", ")}#n(e){let{title:t,label:n}=this.tour.stops[e];return this.choose(t)?.text??(n===void 0?`Stop ${e+1}`:this.nameOf(n))}#o(){let{app:e}=this,{canvas:t}=e,n=()=>{e.walk.begun&&this.markers.place(e.walker.pose),requestAnimationFrame(n)};requestAnimationFrame(n);let s=null;t.addEventListener("pointerdown",i=>s=i.isPrimary?i:null),t.addEventListener("pointerup",i=>{if(!s||i.pointerId!==s.pointerId)return;let r=Math.hypot(i.clientX-s.clientX,i.clientY-s.clientY),l=i.timeStamp-s.timeStamp>st;if(s=null,r>it||l)return;let a=this.markers.at(e.walker.pose,i.clientX,i.clientY);a>=0&&this.show(a)}),addEventListener("keydown",({code:i,target:r,ctrlKey:l,altKey:a,metaKey:c})=>{l||a||c||r instanceof Element&&r.closest("input, select, textarea, audio")||(i==="KeyN"&&this.step(1),i==="KeyP"&&this.step(-1),i==="Escape"&&(this.panel.hidden?this.list.hidden||this.#t(!1):this.close()))})}#i(){let{languages:e,stops:t,title:n}=this.tour,s=this.choose(n),i=u("h2",{lang:s?.tag??"",dir:"auto"},s?.text??"Tour"),r=t.map((h,m)=>{let f=u("button",{dir:"auto",onclick:()=>this.go(m)},this.#n(m));return m===this.stop&&f.setAttribute("aria-current","true"),u("li",{},f)}),l=e.map(h=>u("option",{value:h,selected:h===this.language},at(h))),a=u("select",{ariaLabel:"Language",onchange:()=>this.speak(a.value)},...l),{catalogue:c=""}=this.app.config;this.list.replaceChildren(i,...e.length>1?[a]:[],u("ol",{},...r),...c?[u("p",{},u("a",{href:c},"As a page of text and pictures"))]:[])}speak(e){this.language=e,this.#i(),this.markers.rename(),this.open>=0&&this.show(this.open),v(this.list,"select").focus()}#t(e){this.list.hidden=!e,this.button.setAttribute("aria-expanded",String(e)),!e&&this.list.contains(document.activeElement)&&this.button.focus()}show(e){let{panel:t,tour:n}=this,s=document.activeElement;t.hidden&&(this.#e=s instanceof HTMLElement?s:null),this.open=this.markers.current=e,t.hidden=!1,matchMedia("(max-width: 640px)").matches&&this.#t(!1);let i=n.stops.length>1?[{text:"Previous",go:()=>this.step(-1)},{text:"Next",go:()=>this.step(1)}]:[];_(t,n.labels[e],{choose:this.choose,urlOf:r=>new URL(r,this.url).href,close:()=>this.close(),ways:i}),this.app.emit("label",n.labels[e].id)}close(){let{panel:e}=this,t=e.contains(document.activeElement);e.hidden=!0,e.replaceChildren(),this.open=this.markers.current=-1;let n=this.#e?.isConnected?this.#e:this.app.canvas;t&&n.focus()}visit(e){let t=this.tour.stops.findIndex(n=>n.label===e);t>=0?this.go(t):this.show(e)}step(e){let{length:t}=this.tour.stops;t&&this.go((Math.max(this.stop,e>0?-1:0)+e+t)%t)}go(e){let{app:t,tour:n}=this,{position:s,direction:[i,r,l],label:a}=n.stops[e],c=Math.asin(Math.max(-1,Math.min(1,r/Math.hypot(i,r,l))));this.stop=e,t.follow({eye:[...s],yaw:Math.atan2(-i,-l),pitch:c}),O()||t.canvas.animate([{opacity:0},{opacity:1}],250),this.#i(),a!==void 0?this.show(a):this.panel.hidden||this.close()}};function at(o){try{return new Intl.DisplayNames([o],{type:"language"}).of(o)??o}catch{return o}}export{rt as attachTour};
