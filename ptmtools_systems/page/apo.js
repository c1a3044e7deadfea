var E=class extends Error{constructor(e,t){super(t),this.code=e}};var H=(o,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[o]);var R=H("page",{room:"Loading the room",textures:"Loading textures",outside:"The link leads to a place outside of the building.",unloaded:"A part of this page cannot be loaded now.",copied:"The link to this place is copied.",slow:"Textures load slowly here: the server does not support range requests.",noSimd:"This browser cannot run WebAssembly with SIMD.",noWebgl:"This browser cannot draw with WebGL 2.",damaged:"{file} is damaged: {reason}",offline:"{file} cannot be downloaded: {reason}",missing:"{file} is missing on this site",refused:"{file} is refused with status {reason} on this site",unshown:"{file} is not shown: {reason}",partial:"{file} is not shown with all of its levels: {reason}",undecoded:"Textures cannot be decoded: {reason}",noGeometry:"The geometry cannot be decoded: {reason}","PTM-V101":"Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer, with hardware acceleration on.","PTM-V102":"Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer.","PTM-V103":"Tell the owner of this site: publishing it again should repair it.","PTM-V104":"Check your connection and reload the page.","PTM-V105":"Tell the owner of this site: publishing it again should repair it.","PTM-V106":"Update the browser, or allow this page to use web workers and more memory.",otherwise:"Reload the page. If that does not help, tell the owner of this site."});var N=H("objects",{relief:"The relief of {name} does not fit the index.",object:"an object",octree:"The index has a wrong octree: {reason}",largeTexture:"This graphics card has no textures of 4,096 texels.",largeImage:"The image is larger than this graphics card's textures.",damaged:"{file} is damaged: {reason}",noSets:"This site has no interlaced images, so you see its own textures.",fixed:"The policy and the comparison are those of other textures than interlaced images."}),F=H("form",{reset:"The graphics card has reset the page.",orbit:"Drag or use the arrow keys to turn; wheel, two fingers, + and − to zoom",pan:"Drag or use the arrow keys to move; wheel, two fingers, + and − to zoom",campus:"WASD or the arrow keys to walk, drag to look around, Shift to run",levels:"{count} of {total} levels, {bytes} of {all}",files:"{count} of {total} files, {size} of {whole}, {bytes} of {all}",closer:"finer ones when you come closer",zoom:"finer ones when you zoom in",tooLarge:"more than this graphics card can hold",eightBits:"shown in 8 bits",loading:"loading",near:"{count} of {total} near objects complete",memory:"{bytes} received, {all} of graphics memory",places:"Places",detail:"Detail of near objects",record:"Record",close:"Close"});var be="de fr es it zh ja",O=Promise.resolve(),ee=(o={page:R})=>O=Te(o);async function Te(o){let t=[new URLSearchParams(location.search).get("lang")??"",...navigator.languages].map(r=>r.toLowerCase().split("-")[0]).find(r=>`en ${be}`.split(" ").includes(r))??"en";if(t==="en")return;let s=`./words-${t}.js`,n=await import(s).catch(()=>null);for(let r in o)Object.assign(o[r],n?.words[r])}var I=(o,e)=>o.replace(/\{(\w+)\}/g,(t,s)=>e[s]);var Ee=6,Me=.5,X=20,L=class extends Error{constructor(e,t=!1){super(e),this.anew=t}},A=()=>performance.now()/1e3,_=class{constructor(e){this.notice=e,this.measured=null,this.requests=0,this.bytes=0,this.pending=0,this.ignoresRanges=!1}whole(e,t,s,n="default"){return this.#t(e,n,s,async r=>{let{response:a,body:i}=await this.#o(e,{cache:r},s);if(a.status!==200)throw await te(e,a.status);try{return await t(i)}catch(c){if(c instanceof E)throw c;let h=c.message;throw r==="default"?new L(h,!0):new E("PTM-V105",I(R.damaged,{file:Y(e),reason:h}))}})}range(e,t,s,n,r,a="default"){let i=`bytes=${t}-${s-1}`;return this.#t(e,a,r,async c=>{let{response:h,body:l}=await this.#o(e,{cache:c,headers:{range:i}},r);if(h.status===200){if(l.length!==n)throw new L(`${l.length} of ${n} bytes`,!0);return this.#e(),{begin:0,body:l}}if(h.status!==206)throw await te(e,h.status);let u=h.headers.get("content-range")??`bytes ${t}-${s-1}/${n}`;if(u!==`bytes ${t}-${s-1}/${n}`||l.length!==s-t)throw new L(`${l.length} bytes, "${u}", in place of ${i}`,!0);return{begin:t,body:l}})}#e(){this.ignoresRanges||(this.ignoresRanges=!0,console.warn("This host ignores byte ranges: each texture is downloaded whole before it is seen."),this.notice(R.slow))}async#t(e,t,s,n){let r=s?.left??0,a="";for(let i=0;i<Ee;i++){i&&(s&&Object.assign(s,{left:0,waits:!0}),await Re(Me*2**(i-1))),s&&Object.assign(s,{left:r,waits:!1}),this.pending++;try{return await n(t)}catch(c){if(c instanceof E)throw c;c instanceof L&&c.anew&&(t="no-store"),a=String(c.message)}finally{this.pending--}}throw await O,new E("PTM-V104",I(R.offline,{file:Y(e),reason:a}))}async#o(e,t,s){this.requests++;let n=new AbortController,r=new L(`nothing came for ${X} s`),a=setTimeout(()=>n.abort(r),1e3*X);try{let i=A(),c=await fetch(e,{...t,signal:n.signal}),h=A(),l=c.body?.getReader(),u=[];for(;;){let{done:m,value:y}=await l?.read()??{done:!0,value:void 0};if(m||!y){let d=ke(u);return this.measured?.(i,h,A(),d.length),{response:c,body:d}}clearTimeout(a),a=setTimeout(()=>n.abort(r),1e3*X),u.push(y),this.bytes+=y.length,s&&(s.left-=y.length)}}finally{clearTimeout(a)}}};function ke(o){let e=new Uint8Array(o.reduce((s,{length:n})=>s+n,0)),t=0;for(let s of o)e.set(s,t),t+=s.length;return e}async function te(o,e){if(e>=500||e===429||e===408)return new L(`status ${e}`);await O;let t=e===404?R.missing:R.refused;return new E("PTM-V103",I(t,{file:Y(o),reason:e}))}function Y(o){return decodeURIComponent(new URL(o,location.href).pathname.split("/").pop()??o)}function Re(o){return new Promise(e=>{let t=()=>{clearTimeout(s),removeEventListener("online",t),e(void 0)},s=setTimeout(t,1e3*o);addEventListener("online",t)})}var Ae=Uint32Array.from({length:256},(o,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function C(o,e=0){let t=~e;for(let s=0;s<o.length;s++)t=Ae[(t^o[s])&255]^t>>>8;return~t>>>0}var P=4096,oe=2**24,Se=7,Pe=65536,Ie=new Uint8Array([3,0]),ne=2,Le=4;function p(o,e){if(!o)throw new Error(e)}var D=(o,e,t)=>Number.isInteger(o)&&e<=o&&o<=t;function re({cube:o,levels:e,streams:t}){let s=n=>typeof n=="number"&&Math.abs(n)<=1e15;p(Array.isArray(o?.low)&&o.low.length===3&&o.low.every(s),"no cube"),p(s(o.side)&&o.side>=1e-15,"no cube"),p(Array.isArray(e)&&D(e.length,1,21),"no levels"),p(e.every(n=>D(n,1,oe)),"a level without texels"),p(e.reduce((n,r)=>n+r,0)<=oe,"too many texels");for(let n of t){for(let r of[n?.ends,n?.crc32])p(Array.isArray(r)&&r.length===e.length,"lists of other lengths"),p(r.every(a=>D(a,0,4294967295)),"a list without numbers");p(n.ends.every((r,a)=>r>(a?n.ends[a-1]:ne)),"ends that do not ascend")}}var De=64,Fe=10,Ue=(o,e)=>o?o+1:Math.min(Se,e),se=o=>typeof o?.code=="string"&&o.code.startsWith("PTM-V"),K=class{rows=0;constructor(e,t){this.gl=e;let s=Math.max(1,Math.ceil(t/P));this.size=4*P*s,this.bytes=new Uint8Array(this.size),this.texture=e.createTexture(),this.#e(()=>{e.texStorage2D(e.TEXTURE_2D,1,e.RGBA8UI,P,s);for(let n of[e.TEXTURE_MIN_FILTER,e.TEXTURE_MAG_FILTER])e.texParameteri(e.TEXTURE_2D,n,e.NEAREST)})}#e(e){let{gl:t}=this;t.activeTexture(t.TEXTURE3),t.bindTexture(t.TEXTURE_2D,this.texture),e(),t.activeTexture(t.TEXTURE0)}upload(e){let{gl:t,bytes:s,rows:n}=this;if(!s)return!0;let r=Math.ceil(e/P),a=Math.min(r,n+De);return this.#e(()=>t.texSubImage2D(t.TEXTURE_2D,0,0,n,P,a-n,t.RGBA_INTEGER,t.UNSIGNED_BYTE,s,4*P*n)),this.rows=Math.min(a,Math.floor(e/P)),a===r}},$=class{#e=[0,0];#t=0;#o=!1;#s=[];constructor(e,t,s,n,r){this.gl=e,this.index=t,this.urlOf=s,this.fetcher=n,this.step=r,this.starts=[0];for(let a of t.levels)this.starts.push((this.starts.at(-1)??0)+a);if(this.count=this.starts.at(-1),e.getParameter(e.MAX_TEXTURE_SIZE)<P)throw new E("PTM-V101",N.largeTexture);this.streams=t.streams,this.texels=this.streams.map(()=>new K(e,this.count)),this.levels=0,this.partial=!1,this.updates=0,this.running=!1,this.restsUntil=0,this.progress=void 0}get complete(){return this.levels===this.index.levels.length}delete(){this.#o=!0;for(let{texture:e}of this.texels)this.gl.deleteTexture(e)}get bytes(){return this.texels.reduce((e,{size:t})=>e+t,0)}get rests(){return A()<this.restsUntil}get fetched(){return this.levels?this.streams.reduce((e,{ends:t})=>e+t[this.levels-1],0):0}advance(e,t,s,n=Ue(this.levels,this.index.levels.length)){if(!(this.running||this.complete||this.rests||!e(this.levels)))return this.running=!0,this.#r(n).then(()=>s?.(),r=>{this.restsUntil=r.code==="PTM-V104"?A()+Fe:1/0,this.#o||t(r)}).finally(()=>this.running=!1)}async#r(e){let t=this.step&&this.levels?setInterval(()=>this.#n(),1e3*this.step):0;try{await Promise.all(this.streams.map((s,n)=>this.#a(n,this.levels,e)))}finally{clearInterval(t),this.partial=!1}for(let s of this.texels)for(;!this.#o&&!s.upload(this.starts[e]);)await new Promise(n=>setTimeout(n,16));if(!this.#o&&(this.updates++,this.levels=e,this.complete))for(let s of this.texels)s.bytes=null}#n(){let e=Math.min(...this.#e.slice(0,this.streams.length));if(!(this.#o||e<=Math.max(this.#t,this.starts[this.levels]))){for(let t of this.texels)for(;!t.upload(e););this.#t=e,this.updates++,this.partial=!0}}async#a(e,t,s){try{await this.#i(e,t,s,"default")}catch(n){if(se(n))throw n;this.#s[e]=null,await this.#i(e,t,s,"no-store").catch(r=>{throw se(r)?r:new E("PTM-V105",I(N.damaged,{file:this.streams[e].file,reason:r.message}))})}}async#i(e,t,s,n){let r=this.streams[e],a=this.texels[e],i=a.bytes,c=t?r.ends[t-1]:ne,h=r.ends[s-1]-(s===r.ends.length?Le:0),l=new DecompressionStream("deflate-raw"),u=l.writable.getWriter(),m=4*this.starts[s],y=new Map,d=4*this.starts[t],x=t;a.rows=Math.min(a.rows,Math.floor(this.starts[t]/P)),this.#e[e]=this.#t=this.starts[t];let f=(async()=>{for(let w=l.readable.getReader();;){let{done:S,value:M}=await w.read();if(S)return;p(d+M.length<=m,"more texels than the index says"),i.set(M,d);for(let T=0;T<M.length;){let g=4*this.starts[x+1]-d,b=M.subarray(T,T+g);y.set(x,C(b,y.get(x))),T+=b.length,d+=b.length,b.length===g&&x++}this.#e[e]=Math.floor(d/4)}})();f.catch(()=>{});let v=this.step&&t?Pe:h-c;for(let w=c;w<h;w+=v){let S=await this.#c(e,w,Math.min(w+v,h),n);await Promise.race([u.write(S),f])}s<r.ends.length&&await Promise.race([u.write(Ie),f]),await Promise.all([u.close(),f]),p(d===m,"fewer texels than the index says");for(let w=t;w<s;w++)p(y.get(w)===r.crc32[w],`level ${w} has another checksum`)}async#c(e,t,s,n){let{file:r,ends:a}=this.streams[e],i=a.at(-1),c=this.#s[e];if(!c){let h=await this.fetcher.range(this.urlOf(r),t,s,i,this.progress,n);if(h.begin===t&&h.body.length===s-t)return h.body;c=this.#s[e]=h.body}return c.subarray(t,s)}};function k(o,e){let t=o.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function ie(o,e={},...t){let s=document.createElement(o);for(let[n,r]of Object.entries(e))n in s?Reflect.set(s,n,r):s.setAttribute(n,r);return s.append(...t),s}function J(o){let e=o<1e6?["kB",1e3]:["MB",1e6],t=o/Number(e[1]);return`${t.toFixed(t<10?1:0)} ${e[0]}`}var ae=8e3,Ne=["nav","#panels","#view"];function ce(o,{code:e,message:t}){let s=k(o,"#error"),n=k(o,"#again");k(o,"#error-text").textContent=t,k(o,"#error-remedy").textContent=R[e]??R.otherwise,k(o,"#error-code").textContent=e,k(o,"#loading").hidden=!0,s.hidden=!1;for(let r of Ne)k(o,r).inert=!0;n.onclick=()=>location.reload(),n.focus()}function B(o,...e){let t=ie("p",{},...e);k(o,"#notices").append(t);let s=()=>{t.contains(o.activeElement)?setTimeout(s,ae):t.remove()};setTimeout(s,ae)}function le(o){let e={antialias:!0,failIfMajorPerformanceCaveat:!0},t={antialias:!1};return o.getContext("webgl2",e)??o.getContext("webgl2",t)}var Oe=o=>Math.round(o*1e5)/1e5,z=class{#e=[];#t=A();constructor(e,t){this.canvas=e,this.look=t}frame(){let{eye:e,direction:t}=this.look(),n=[this.#e.length?A()-this.#t:0,...Array.from(e),...Array.from(t)].map(Oe);(!this.#e.length||n[0]>this.#e[this.#e.length-1][0])&&this.#e.push(n)}get document(){let{canvas:{width:e,height:t}}=this;return{format:"ptmtools walk",schema:1,fieldOfView:this.look().angle,aspect:e/t,samples:this.#e}}};var _e=15,Ce=5;async function he(o){let e=!1,t=!1,s=n=>{e=!0;let r=n instanceof E;ce(document,r?n:new E("PTM-V107",String(n)))};try{await ee({page:R,form:F,objects:N});let n=k(document,"canvas"),r=JSON.parse(k(document,"#site").textContent??""),a=le(n);if(!a)throw new E("PTM-V101",R.noWebgl);let i=null,c=A();n.addEventListener("webglcontextlost",f=>{f.preventDefault(),t=!0;let v=()=>s(new E("PTM-V107",F.reset));A()-c<Ce?v():setTimeout(v,1e3*_e)}),n.addEventListener("webglcontextrestored",()=>{e||(i?.address&&history.replaceState(null,"",i.address()),location.reload())});let h=new _(f=>B(document,f));i=await o(a,r,h,f=>{t||s(f)});let l=i,{look:u}=i,m=null;u&&Object.defineProperties(i,{record:{value:()=>m=new z(n,u)},recording:{get:()=>m?.document??null}}),Object.assign(window,{ptm:i});let y=k(document,"#status"),d=A(),x=()=>{if(e||t)return;let f=A();try{$e(n);let v=l.frame(Math.min(f-d,.1));m?.frame(),y.textContent!==v&&(y.textContent=v)}catch(v){throw s(v),v}d=f,requestAnimationFrame(x)};requestAnimationFrame(x),document.body.classList.add("begun"),addEventListener("keydown",()=>document.body.classList.add("keys"),{once:!0})}catch(n){s(n)}}function $e(o){let e=Math.max(1,Math.round(o.clientWidth*devicePixelRatio)),t=Math.max(1,Math.round(o.clientHeight*devicePixelRatio));(o.width!==e||o.height!==t)&&Object.assign(o,{width:e,height:t})}function ue(o,e,t){return o.whole(e,s=>t(JSON.parse(new TextDecoder("utf-8",{fatal:!0}).decode(s))))}var Z=(o="",e="")=>`#version 300 es
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
}`,Be=`
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
}`,ze=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${Be}
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
}`,de=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,Ve=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${de}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,je=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${de}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,fe={surface:[Z(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),ze],item:[Z(),Ve],placeholder:[Z(),je]};function me(o,e,t=fe[e]){let s=o.createProgram(),n=[o.VERTEX_SHADER,o.FRAGMENT_SHADER];if(t.forEach((i,c)=>{let h=o.createShader(n[c]);o.shaderSource(h,i),o.compileShader(h),o.attachShader(s,h),o.deleteShader(h)}),o.linkProgram(s),!o.getProgramParameter(s,o.LINK_STATUS)&&!o.isContextLost())throw new Error(`${e}: ${o.getProgramInfoLog(s)}`);let r={},a=o.isContextLost()?0:o.getProgramParameter(s,o.ACTIVE_UNIFORMS);for(let i=0;i<a;i++){let c=o.getActiveUniform(s,i)?.name??"";r[c]=o.getUniformLocation(s,c)}return{program:s,at:r}}var pe=`
uniform usampler2D octree;
uniform int texels,deepest;
uniform bool partial;
uvec4 texel(usampler2D of,int address){
return texelFetch(of,ivec2(address % ${P},address/${P}),0);
}
int ones(uint mask){
mask-=mask >> 1u & 0x55u;
mask=(mask & 0x33u)+(mask >> 2u & 0x33u);
return int((mask+(mask >> 4u))& 0x0fu);
}
int addressAt(vec3 at,int stop){
at=clamp(at,0.0,0.99999994);
int address=0;
uvec4 here=texel(octree,0);
stop=min(stop,deepest+int(partial));
for(int depth=0; here.a !=0u && depth < stop && address+1 < texels; depth++){
at*=2.0;
bvec3 upper=greaterThanEqual(at,vec3(1.0));
at-=vec3(upper);
uint bit=1u <<(uint(upper.x)+2u*uint(upper.y)+4u*uint(upper.z));
if((here.a & bit)==0u)break;
uvec4 below=texel(octree,address+1);
int next=int(below.r | below.g << 8u | below.b << 16u);
next+=ones(here.a &(bit-1u))+ones(below.a &(bit-1u));
if(next >=texels)break;
uvec4 there=texel(octree,next);
if(partial && depth==deepest && there.rgb==uvec3(0u))break;
address=next;
here=there;
}
return address;
}
int stopDepth(vec3 at){
vec3 dx=dFdx(at),dy=dFdy(at);
return-((floatBitsToInt(min(dot(dx,dx),dot(dy,dy)))>> 23)-127 >> 1);
}`;var We=.2,Ge=.7,qe=.2,He=[-.5,.65,.6],Xe=[.8,-.3,.5],Ye=[.93,.9,.85],Ke=[58,62,70].map(o=>o/255),Je=`#version 300 es
in vec3 corner;
in vec3 own;
uniform vec3 eye,right,up,ahead;
uniform vec2 lens;
uniform float near;
out highp vec3 q;
out highp vec3 normal;
void main(){
vec3 p=corner-eye;
float z=dot(p,ahead);
q=corner;
normal=own;
gl_Position=vec4(dot(p,right)/lens.x,dot(p,up)/lens.y,z-2.0*near,z);
}`,Ze=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in highp vec3 q;
in highp vec3 normal;
uniform usampler2D colors;
uniform bool colored,bare;
uniform vec3 key,fill,stone;
out vec4 shown;
${pe}
void main(){
int stop=stopDepth(q);
vec3 n=normal;
vec3 color=stone;
if(deepest >=0){
int address=addressAt(q,stop);
n=vec3(texel(octree,address).rgb)/127.5-1.0;
if(colored)color=vec3(texel(colors,address).rgb)/255.0;
}
n=normalize(n);
float light=${We}+${Ge}*max(dot(n,key),0.0)+${qe}*max(dot(n,fill),0.0);
shown=vec4(bare?n*0.5+0.5:min(color*light,1.0),1.0);
}`;function we(o,e){p(C(o)===e,"another checksum");let t=new DataView(o.buffer,o.byteOffset,o.length);p(o.length>=28&&t.getUint32(0,!0)===1179937895,"not a GLB");let s=t.getUint32(12,!0),n=20+s+8;p(n<=o.length,"a chunk that leads out of the file");let{bufferViews:r,accessors:a}=JSON.parse(new TextDecoder().decode(o.subarray(20,20+s))),i=o.slice(n),c=(x,f,v)=>{let w=a[x].count*v,S=r[x].byteOffset??0;return p(D(w,1,2**31)&&D(S,0,i.length),"an impossible accessor"),p(S+w*f.BYTES_PER_ELEMENT<=i.length,"an accessor that leads out of its bytes"),new f(i.buffer,S,w)},h=c(0,Float32Array,3),l=c(1,Float32Array,3),u={5123:Uint16Array,5125:Uint32Array}[a[2].componentType];p(u&&l.length===h.length,"arrays that do not match");let m=c(2,u,1);p(h.every(Number.isFinite)&&l.every(Number.isFinite),"a number that is not finite"),p(m.every(x=>x<h.length/3),"an index out of range");let y=[1/0,1/0,1/0],d=[-1/0,-1/0,-1/0];return h.forEach((x,f)=>{y[f%3]=Math.min(y[f%3],x),d[f%3]=Math.max(d[f%3],x)}),{positions:h,normals:l,indices:m,low:y,high:d}}var V=class{constructor(e,{positions:t,normals:s,indices:n,low:r,high:a},{low:i,side:c}){this.gl=e,this.use=me(e,"octree",[Je,Ze]),this.cube={corner:i,side:c},this.radius=Math.hypot(...a.map((l,u)=>l-r[u]))/c/2,this.count=n.length,this.type=n instanceof Uint16Array?e.UNSIGNED_SHORT:e.UNSIGNED_INT,this.array=e.createVertexArray(),e.bindVertexArray(this.array);let h=t.map((l,u)=>(l-i[u%3])/c);for(let[l,u]of[["corner",h],["own",s]]){let m=e.getAttribLocation(this.use.program,l);e.bindBuffer(e.ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ARRAY_BUFFER,u,e.STATIC_DRAW),e.enableVertexAttribArray(m),e.vertexAttribPointer(m,3,e.FLOAT,!1,0,0)}e.bindBuffer(e.ELEMENT_ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ELEMENT_ARRAY_BUFFER,n,e.STATIC_DRAW)}draw(e,t,{bare:s,levels:n}){let{gl:r,use:{program:a,at:i},cube:{corner:c,side:h}}=this,{right:l,up:u,ahead:m,half:y}=t,d=t.away/h;r.viewport(0,0,r.drawingBufferWidth,r.drawingBufferHeight);let[x,f,v]=s?[0,0,0]:Ke;r.clearColor(x,f,v,1),r.clear(r.COLOR_BUFFER_BIT|r.DEPTH_BUFFER_BIT),r.enable(r.DEPTH_TEST),r.useProgram(a),r.bindVertexArray(this.array),e.texels.forEach(({texture:M},T)=>{r.activeTexture(r.TEXTURE0+T),r.bindTexture(r.TEXTURE_2D,M)});let w=Math.min(e.levels,n)-1,S=e.texels.length>1;r.uniform1i(i.octree,0),r.uniform1i(i.colors,S?1:0),r.uniform1i(i.texels,e.count),r.uniform1i(i.deepest,w),r.uniform1i(i.partial,Number(e.partial&&e.levels<n)),r.uniform1i(i.colored,Number(S)),r.uniform1i(i.bare,Number(s)),r.uniform3fv(i.eye,t.eye.map((M,T)=>(M-c[T])/h));for(let[M,T]of Object.entries({right:l,up:u,ahead:m}))r.uniform3fv(i[M],T);r.uniform2fv(i.lens,y),r.uniform1f(i.near,Math.max(d-this.radius,d/64)/2);for(let[M,T]of Object.entries({key:He,fill:Xe})){let g=l.map((b,U)=>T[0]*l[U]+T[1]*u[U]-T[2]*m[U]);r.uniform3fv(i[M],g.map(b=>b/Math.hypot(...g)))}r.uniform3fv(i.stone,Ye),r.drawElements(r.TRIANGLES,this.count,this.type,0)}pixels(e,t,s){let n=Math.max(s.away/this.cube.side-this.radius,1e-6);return t/(2*s.half[1]*n)*2**-e}};var W=35*Math.PI/180,ge=.4,j=60,Qe=.0015,et=.05,tt=20,xe={ArrowLeft:[-j,0,0],ArrowRight:[j,0,0],ArrowUp:[0,j,0],ArrowDown:[0,-j,0],Equal:[0,0,-1],NumpadAdd:[0,0,-1],Minus:[0,0,1],NumpadSubtract:[0,0,1]},G=class{#e=new Set;#t=new Map;constructor(e,t,s){this.canvas=e,this.middle=t,this.diameter=s,this.azimuth=25,this.elevation=15,this.distance=0;let[n,r,a=0]=location.hash.slice(1).split(",").map(Number);[n,r,a].every(Number.isFinite)&&this.place(n,r,a),e.focus({preventScroll:!0}),e.addEventListener("pointerdown",i=>{i.button===0&&(e.setPointerCapture(i.pointerId),this.#t.set(i.pointerId,{x:i.clientX,y:i.clientY}))});for(let i of["pointerup","pointercancel"])e.addEventListener(i,c=>this.#t.delete(c.pointerId));e.addEventListener("pointermove",i=>this.#r(i)),e.addEventListener("wheel",i=>{i.preventDefault(),this.#s(Math.exp(i.deltaY*Qe))},{passive:!1}),e.addEventListener("keydown",i=>{if(i.ctrlKey||i.metaKey||i.altKey)return this.#e.clear();i.code in xe&&(i.preventDefault(),this.#e.add(i.code))}),e.addEventListener("keyup",i=>this.#e.delete(i.code)),e.addEventListener("blur",()=>this.#e.clear())}place(e,t,s=0){this.azimuth=e%360,this.elevation=Math.max(-90,Math.min(90,t)),this.distance=s>0?Math.max(et,Math.min(tt,s)):0}step(e){for(let t of this.#e){let[s,n,r]=xe[t];this.place(this.azimuth+s*e,this.elevation+n*e,this.distance),r&&this.#s(Math.exp(r*e))}}get camera(){let e=this.canvas.width/this.canvas.height,t=Math.tan(W/2),[s,n]=[this.azimuth,this.elevation].map(u=>u*Math.PI/180),r=[Math.sin(s)*Math.cos(n),Math.sin(n),Math.cos(s)*Math.cos(n)],a=(this.distance||this.#o(e,t))*this.diameter,i=this.middle.map((u,m)=>u+a*r[m]),c=r.map(u=>-u),h=Math.hypot(c[0],c[2]),l=h<1e-9?[1,0,0]:[-c[2]/h,0,c[0]/h];return{eye:i,right:l,up:ot(l,c),ahead:c,away:a,half:[t*e,t]}}#o(e,t){return .5/Math.sin(Math.atan(t*Math.min(1,e)))}#s(e){let{width:t,height:s}=this.canvas,n=this.distance||this.#o(t/s,Math.tan(W/2));this.place(this.azimuth,this.elevation,n*e)}#r(e){let t=this.#t.get(e.pointerId);if(!t)return;let s=this.#n(),n={x:e.clientX,y:e.clientY};if(this.#t.set(e.pointerId,n),this.#t.size===1){let[r,a]=[n.x-t.x,n.y-t.y];this.place(this.azimuth-r*ge,this.elevation+a*ge,this.distance)}else s>0&&this.#n()>0&&this.#s(s/this.#n())}#n(){let[e,t]=this.#t.values();return e&&t?Math.hypot(e.x-t.x,e.y-t.y):0}},ot=(o,e)=>[o[1]*e[2]-o[2]*e[1],o[2]*e[0]-o[0]*e[2],o[0]*e[1]-o[1]*e[0]];function st(o){p(o?.format==="ptmtools apo"&&o.schema===1,"not an index of an octree texture");let{cube:e,levels:t,normals:s,colors:n,mesh:r}=o;p(s?.file==="apo.bin"&&(n??{file:"color.bin"}).file==="color.bin","other streams");let a={cube:e,levels:t,streams:n?[s,n]:[s]};return re(a),p(r?.file==="mesh.glb"&&D(r.crc32,0,4294967295),"no mesh"),{...a,mesh:r}}he(async(o,e,t,s)=>{let n=new URLSearchParams(location.search),r=new URL(e.index,location.href).href,a=g=>new URL(g,r).href,i=await ue(t,r,st),c=await t.whole(a(i.mesh.file),g=>we(g,i.mesh.crc32)),h=n.get("update")==="steps"?Math.max(.05,Number(n.get("step"))||.5):0,l=new $(o,i,a,t,h),u=new V(o,c,i.cube),m=o.canvas,y=c.low.map((g,b)=>(g+c.high[b])/2),d=new G(m,y,Math.hypot(...c.high.map((g,b)=>g-c.low[b]))),x=n.has("levels")?Math.max(0,Number(n.get("levels"))||0):1/0,f=n.has("normals"),v=i.streams.reduce((g,{ends:b})=>g+(b.at(-1)??0),0),w=!1,S="",M=0,T=g=>l.levels?B(document,g.message):s(g);return k(document,"#keys").textContent=F.orbit,{frame(g){d.step(g);let{camera:b}=d,U=q=>q<x&&(!q||u.pixels(q-1,m.height,b)>1);l.advance(U,T),w=!l.complete&&!U(l.levels);let Q=[m.width,m.height,...b.eye,l.updates,l.partial].join();Q!==S&&u.draw(l,b,{bare:f,levels:x}),S=Q,M=l.levels;let ye=l.complete||l.levels>=x?"":w?`; ${F.closer}`:" …",ve={count:l.levels,total:i.levels.length,bytes:J(l.fetched),all:J(v)};return I(F.levels,ve)+ye},state:()=>({levels:l.levels,partial:l.partial,complete:l.complete&&M===l.levels,paused:w,updates:l.updates,requests:t.requests,bytes:t.bytes,pending:t.pending,camera:d.camera}),address:()=>`#${[d.azimuth,d.elevation,d.distance].map(g=>Number(g.toFixed(3))).join()}`,look:()=>({eye:d.camera.eye,direction:d.camera.ahead,angle:W}),place:d.place.bind(d)}});
