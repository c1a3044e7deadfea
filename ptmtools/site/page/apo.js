var T=class extends Error{constructor(e,t){super(t),this.code=e}};var pe=6,we=.5,z=20,P=class extends Error{constructor(e,t=!1){super(e),this.anew=t}},A=()=>performance.now()/1e3,L=class{constructor(e){this.notice=e,this.measured=null,this.requests=0,this.bytes=0,this.pending=0,this.ignoresRanges=!1}whole(e,t,n,o="default"){return this.#t(e,o,n,async r=>{let{response:a,body:i}=await this.#s(e,{cache:r},n);if(a.status!==200)throw Y(e,a.status);try{return await t(i)}catch(c){if(c instanceof T)throw c;let l=c.message;throw r==="default"?new P(l,!0):new T("PTM-V105",`${X(e)} is damaged: ${l}`)}})}range(e,t,n,o,r,a="default"){let i=`bytes=${t}-${n-1}`;return this.#t(e,a,r,async c=>{let{response:l,body:h}=await this.#s(e,{cache:c,headers:{range:i}},r);if(l.status===200){if(h.length!==o)throw new P(`${h.length} of ${o} bytes`,!0);return this.#e(),{begin:0,body:h}}if(l.status!==206)throw Y(e,l.status);let f=l.headers.get("content-range")??`bytes ${t}-${n-1}/${o}`;if(f!==`bytes ${t}-${n-1}/${o}`||h.length!==n-t)throw new P(`${h.length} bytes, "${f}", in place of ${i}`,!0);return{begin:t,body:h}})}#e(){this.ignoresRanges||(this.ignoresRanges=!0,console.warn("This host ignores byte ranges: each texture is downloaded whole before it is seen."),this.notice("Textures load slowly here: the server does not support range requests."))}async#t(e,t,n,o){let r=n?.left??0,a="";for(let i=0;i<pe;i++){i&&(n&&Object.assign(n,{left:0,waits:!0}),await ge(we*2**(i-1))),n&&Object.assign(n,{left:r,waits:!1}),this.pending++;try{return await o(t)}catch(c){if(c instanceof T)throw c;c instanceof P&&c.anew&&(t="no-store"),a=String(c.message)}finally{this.pending--}}throw new T("PTM-V104",`${X(e)} cannot be downloaded: ${a}`)}async#s(e,t,n){this.requests++;let o=new AbortController,r=new P(`nothing came for ${z} s`),a=setTimeout(()=>o.abort(r),1e3*z);try{let i=A(),c=await fetch(e,{...t,signal:o.signal}),l=A(),h=c.body?.getReader(),f=[];for(;;){let{done:m,value:v}=await h?.read()??{done:!0,value:void 0};if(m||!v){let u=xe(f);return this.measured?.(i,l,A(),u.length),{response:c,body:u}}clearTimeout(a),a=setTimeout(()=>o.abort(r),1e3*z),f.push(v),this.bytes+=v.length,n&&(n.left-=v.length)}}finally{clearTimeout(a)}}};function xe(s){let e=new Uint8Array(s.reduce((n,{length:o})=>n+o,0)),t=0;for(let n of s)e.set(n,t),t+=n.length;return e}function Y(s,e){if(e>=500||e===429||e===408)return new P(`status ${e}`);let t=e===404?"is missing":`is refused with status ${e}`;return new T("PTM-V103",`${X(s)} ${t} on this site`)}function X(s){return decodeURIComponent(new URL(s,location.href).pathname.split("/").pop()??s)}function ge(s){return new Promise(e=>{let t=()=>{clearTimeout(n),removeEventListener("online",t),e(void 0)},n=setTimeout(t,1e3*s);addEventListener("online",t)})}var ve=Uint32Array.from({length:256},(s,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function $(s,e=0){let t=~e;for(let n=0;n<s.length;n++)t=ve[(t^s[n])&255]^t>>>8;return~t>>>0}var I=4096,K=2**24,ye=7,Ee=65536,be=new Uint8Array([3,0]),J=2,Te=4;function p(s,e){if(!s)throw new Error(e)}var k=(s,e,t)=>Number.isInteger(s)&&e<=s&&s<=t;function Z({cube:s,levels:e,streams:t}){let n=o=>typeof o=="number"&&Math.abs(o)<=1e15;p(Array.isArray(s?.low)&&s.low.length===3&&s.low.every(n),"no cube"),p(n(s.side)&&s.side>=1e-15,"no cube"),p(Array.isArray(e)&&k(e.length,1,21),"no levels"),p(e.every(o=>k(o,1,K)),"a level without texels"),p(e.reduce((o,r)=>o+r,0)<=K,"too many texels");for(let o of t){for(let r of[o?.ends,o?.crc32])p(Array.isArray(r)&&r.length===e.length,"lists of other lengths"),p(r.every(a=>k(a,0,4294967295)),"a list without numbers");p(o.ends.every((r,a)=>r>(a?o.ends[a-1]:J)),"ends that do not ascend")}}var Me=64,Re=10,Ae=(s,e)=>s?s+1:Math.min(ye,e),j=s=>typeof s?.code=="string"&&s.code.startsWith("PTM-V"),q=class{rows=0;constructor(e,t){this.gl=e;let n=Math.max(1,Math.ceil(t/I));this.size=4*I*n,this.bytes=new Uint8Array(this.size),this.texture=e.createTexture(),this.#e(()=>{e.texStorage2D(e.TEXTURE_2D,1,e.RGBA8UI,I,n);for(let o of[e.TEXTURE_MIN_FILTER,e.TEXTURE_MAG_FILTER])e.texParameteri(e.TEXTURE_2D,o,e.NEAREST)})}#e(e){let{gl:t}=this;t.activeTexture(t.TEXTURE1),t.bindTexture(t.TEXTURE_2D,this.texture),e(),t.activeTexture(t.TEXTURE0)}upload(e){let{gl:t,bytes:n,rows:o}=this;if(!n)return!0;let r=Math.ceil(e/I),a=Math.min(r,o+Me);return this.#e(()=>t.texSubImage2D(t.TEXTURE_2D,0,0,o,I,a-o,t.RGBA_INTEGER,t.UNSIGNED_BYTE,n,4*I*o)),this.rows=Math.min(a,Math.floor(e/I)),a===r}},F=class{#e=[0,0];#t=0;#s=!1;#n=[];constructor(e,t,n,o,r){this.gl=e,this.index=t,this.urlOf=n,this.fetcher=o,this.step=r,this.starts=[0];for(let a of t.levels)this.starts.push((this.starts.at(-1)??0)+a);if(this.count=this.starts.at(-1),e.getParameter(e.MAX_TEXTURE_SIZE)<I)throw new T("PTM-V101","This graphics card has no textures of 4,096 texels.");this.streams=t.streams,this.texels=this.streams.map(()=>new q(e,this.count)),this.levels=0,this.partial=!1,this.updates=0,this.running=!1,this.restsUntil=0,this.progress=void 0}get complete(){return this.levels===this.index.levels.length}delete(){this.#s=!0;for(let{texture:e}of this.texels)this.gl.deleteTexture(e)}get bytes(){return this.texels.reduce((e,{size:t})=>e+t,0)}get rests(){return A()<this.restsUntil}get fetched(){return this.levels?this.streams.reduce((e,{ends:t})=>e+t[this.levels-1],0):0}advance(e,t,n,o=Ae(this.levels,this.index.levels.length)){if(!(this.running||this.complete||this.rests||!e(this.levels)))return this.running=!0,this.#r(o).then(()=>n?.(),r=>{this.restsUntil=r.code==="PTM-V104"?A()+Re:1/0,this.#s||t(r)}).finally(()=>this.running=!1)}async#r(e){let t=this.step&&this.levels?setInterval(()=>this.#o(),1e3*this.step):0;try{await Promise.all(this.streams.map((n,o)=>this.#a(o,this.levels,e)))}finally{clearInterval(t),this.partial=!1}for(let n of this.texels)for(;!this.#s&&!n.upload(this.starts[e]);)await new Promise(o=>setTimeout(o,16));if(!this.#s&&(this.updates++,this.levels=e,this.complete))for(let n of this.texels)n.bytes=null}#o(){let e=Math.min(...this.#e.slice(0,this.streams.length));if(!(this.#s||e<=Math.max(this.#t,this.starts[this.levels]))){for(let t of this.texels)for(;!t.upload(e););this.#t=e,this.updates++,this.partial=!0}}async#a(e,t,n){try{await this.#i(e,t,n,"default")}catch(o){if(j(o))throw o;this.#n[e]=null,await this.#i(e,t,n,"no-store").catch(r=>{throw j(r)?r:new T("PTM-V105",`${this.streams[e].file} is damaged: ${r.message}`)})}}async#i(e,t,n,o){let r=this.streams[e],a=this.texels[e],i=a.bytes,c=t?r.ends[t-1]:J,l=r.ends[n-1]-(n===r.ends.length?Te:0),h=new DecompressionStream("deflate-raw"),f=h.writable.getWriter(),m=4*this.starts[n],v=new Map,u=4*this.starts[t],g=t;a.rows=Math.min(a.rows,Math.floor(this.starts[t]/I)),this.#e[e]=this.#t=this.starts[t];let d=(async()=>{for(let w=h.readable.getReader();;){let{done:S,value:M}=await w.read();if(S)return;p(u+M.length<=m,"more texels than the index says"),i.set(M,u);for(let b=0;b<M.length;){let x=4*this.starts[g+1]-u,E=M.subarray(b,b+x);v.set(g,$(E,v.get(g))),b+=E.length,u+=E.length,E.length===x&&g++}this.#e[e]=Math.floor(u/4)}})();d.catch(()=>{});let y=this.step&&t?Ee:l-c;for(let w=c;w<l;w+=y){let S=await this.#c(e,w,Math.min(w+y,l),o);await Promise.race([f.write(S),d])}n<r.ends.length&&await Promise.race([f.write(be),d]),await Promise.all([f.close(),d]),p(u===m,"fewer texels than the index says");for(let w=t;w<n;w++)p(v.get(w)===r.crc32[w],`level ${w} has another checksum`)}async#c(e,t,n,o){let{file:r,ends:a}=this.streams[e],i=a.at(-1),c=this.#n[e];if(!c){let l=await this.fetcher.range(this.urlOf(r),t,n,i,this.progress,o);if(l.begin===t&&l.body.length===n-t)return l.body;c=this.#n[e]=l.body}return c.subarray(t,n)}};function R(s,e){let t=s.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function Q(s,e={},...t){let n=document.createElement(s);for(let[o,r]of Object.entries(e))o in n?Reflect.set(n,o,r):n.setAttribute(o,r);return n.append(...t),n}function G(s){let e=s<1e6?["kB",1e3]:["MB",1e6],t=s/Number(e[1]);return`${t.toFixed(t<10?1:0)} ${e[0]}`}var ee="Tell the owner of this site: publishing it again should repair it.",te="Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer",Se={"PTM-V101":`${te}, with hardware acceleration on.`,"PTM-V102":`${te}.`,"PTM-V103":ee,"PTM-V104":"Check your connection and reload the page.","PTM-V106":"Update the browser, or allow this page to use web workers and more memory.","PTM-V105":ee},Ie="Reload the page. If that does not help, tell the owner of this site.",se=8e3,Pe=["nav","#panels","#view"];function ne(s,{code:e,message:t}){let n=R(s,"#error"),o=R(s,"#again");R(s,"#error-text").textContent=t,R(s,"#error-remedy").textContent=Se[e]??Ie,R(s,"#error-code").textContent=e,R(s,"#loading").hidden=!0,n.hidden=!1;for(let r of Pe)R(s,r).inert=!0;o.onclick=()=>location.reload(),o.focus()}function D(s,...e){let t=Q("p",{},...e);R(s,"#notices").append(t);let n=()=>{t.contains(s.activeElement)?setTimeout(n,se):t.remove()};setTimeout(n,se)}function oe(s){let e={antialias:!0,failIfMajorPerformanceCaveat:!0},t={antialias:!1};return s.getContext("webgl2",e)??s.getContext("webgl2",t)}var ke=s=>Math.round(s*1e5)/1e5,N=class{#e=[];#t=A();constructor(e,t){this.canvas=e,this.look=t}frame(){let{eye:e,direction:t}=this.look(),o=[this.#e.length?A()-this.#t:0,...Array.from(e),...Array.from(t)].map(ke);(!this.#e.length||o[0]>this.#e[this.#e.length-1][0])&&this.#e.push(o)}get document(){let{canvas:{width:e,height:t}}=this;return{format:"ptmtools walk",schema:1,fieldOfView:this.look().angle,aspect:e/t,samples:this.#e}}};var Ue=15,Le=5;async function re(s){let e=!1,t=!1,n=o=>{e=!0;let r=o instanceof T;ne(document,r?o:new T("PTM-V107",String(o)))};try{let o=R(document,"canvas"),r=JSON.parse(R(document,"#site").textContent??""),a=oe(o);if(!a)throw new T("PTM-V101","This browser cannot draw with WebGL 2.");let i=null,c=A();o.addEventListener("webglcontextlost",d=>{d.preventDefault(),t=!0;let y=()=>n(new T("PTM-V107","The graphics card has reset the page."));A()-c<Le?y():setTimeout(y,1e3*Ue)}),o.addEventListener("webglcontextrestored",()=>{e||(i?.address&&history.replaceState(null,"",i.address()),location.reload())});let l=new L(d=>D(document,d));i=await s(a,r,l,d=>{t||n(d)});let h=i,{look:f}=i,m=null;f&&Object.defineProperties(i,{record:{value:()=>m=new N(o,f)},recording:{get:()=>m?.document??null}}),Object.assign(window,{ptm:i});let v=R(document,"#status"),u=A(),g=()=>{if(e||t)return;let d=A();try{$e(o);let y=h.frame(Math.min(d-u,.1));m?.frame(),v.textContent!==y&&(v.textContent=y)}catch(y){throw n(y),y}u=d,requestAnimationFrame(g)};requestAnimationFrame(g),document.body.classList.add("begun"),addEventListener("keydown",()=>document.body.classList.add("keys"),{once:!0})}catch(o){n(o)}}function $e(s){let e=Math.max(1,Math.round(s.clientWidth*devicePixelRatio)),t=Math.max(1,Math.round(s.clientHeight*devicePixelRatio));(s.width!==e||s.height!==t)&&Object.assign(s,{width:e,height:t})}function ie(s,e,t){return s.whole(e,n=>t(JSON.parse(new TextDecoder("utf-8",{fatal:!0}).decode(n))))}var H=(s="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${s}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,Fe=`
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
}`,De=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${Fe}
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
}`,ae=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,Ne=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${ae}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,Oe=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${ae}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,ce={surface:[H(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),De],item:[H(),Ne],placeholder:[H(),Oe]};function he(s,e,t=ce[e]){let n=s.createProgram(),o=[s.VERTEX_SHADER,s.FRAGMENT_SHADER];if(t.forEach((i,c)=>{let l=s.createShader(o[c]);s.shaderSource(l,i),s.compileShader(l),s.attachShader(n,l),s.deleteShader(l)}),s.linkProgram(n),!s.getProgramParameter(n,s.LINK_STATUS)&&!s.isContextLost())throw new Error(`${e}: ${s.getProgramInfoLog(n)}`);let r={},a=s.isContextLost()?0:s.getProgramParameter(n,s.ACTIVE_UNIFORMS);for(let i=0;i<a;i++){let c=s.getActiveUniform(n,i)?.name??"";r[c]=s.getUniformLocation(n,c)}return{program:n,at:r}}var le=`
uniform usampler2D octree;
uniform int texels,deepest;
uniform bool partial;
uvec4 texel(usampler2D of,int address){
return texelFetch(of,ivec2(address % ${I},address/${I}),0);
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
}`;var _e=.2,Ce=.7,Be=.2,Ve=[-.5,.65,.6],ze=[.8,-.3,.5],Xe=[.93,.9,.85],qe=[58,62,70].map(s=>s/255),Ge=`#version 300 es
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
}`,He=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in highp vec3 q;
in highp vec3 normal;
uniform usampler2D colors;
uniform bool colored,bare;
uniform vec3 key,fill,stone;
out vec4 shown;
${le}
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
float light=${_e}+${Ce}*max(dot(n,key),0.0)+${Be}*max(dot(n,fill),0.0);
shown=vec4(bare?n*0.5+0.5:min(color*light,1.0),1.0);
}`;function fe(s,e){p($(s)===e,"another checksum");let t=new DataView(s.buffer,s.byteOffset,s.length);p(s.length>=28&&t.getUint32(0,!0)===1179937895,"not a GLB");let n=t.getUint32(12,!0),o=20+n+8;p(o<=s.length,"a chunk that leads out of the file");let{bufferViews:r,accessors:a}=JSON.parse(new TextDecoder().decode(s.subarray(20,20+n))),i=s.slice(o),c=(g,d,y)=>{let w=a[g].count*y,S=r[g].byteOffset??0;return p(k(w,1,2**31)&&k(S,0,i.length),"an impossible accessor"),p(S+w*d.BYTES_PER_ELEMENT<=i.length,"an accessor that leads out of its bytes"),new d(i.buffer,S,w)},l=c(0,Float32Array,3),h=c(1,Float32Array,3),f={5123:Uint16Array,5125:Uint32Array}[a[2].componentType];p(f&&h.length===l.length,"arrays that do not match");let m=c(2,f,1);p(l.every(Number.isFinite)&&h.every(Number.isFinite),"a number that is not finite"),p(m.every(g=>g<l.length/3),"an index out of range");let v=[1/0,1/0,1/0],u=[-1/0,-1/0,-1/0];return l.forEach((g,d)=>{v[d%3]=Math.min(v[d%3],g),u[d%3]=Math.max(u[d%3],g)}),{positions:l,normals:h,indices:m,low:v,high:u}}var O=class{constructor(e,{positions:t,normals:n,indices:o,low:r,high:a},{low:i,side:c}){this.gl=e,this.use=he(e,"octree",[Ge,He]),this.cube={corner:i,side:c},this.radius=Math.hypot(...a.map((h,f)=>h-r[f]))/c/2,this.count=o.length,this.type=o instanceof Uint16Array?e.UNSIGNED_SHORT:e.UNSIGNED_INT,this.array=e.createVertexArray(),e.bindVertexArray(this.array);let l=t.map((h,f)=>(h-i[f%3])/c);for(let[h,f]of[["corner",l],["own",n]]){let m=e.getAttribLocation(this.use.program,h);e.bindBuffer(e.ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ARRAY_BUFFER,f,e.STATIC_DRAW),e.enableVertexAttribArray(m),e.vertexAttribPointer(m,3,e.FLOAT,!1,0,0)}e.bindBuffer(e.ELEMENT_ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ELEMENT_ARRAY_BUFFER,o,e.STATIC_DRAW)}draw(e,t,{bare:n,levels:o}){let{gl:r,use:{program:a,at:i},cube:{corner:c,side:l}}=this,{right:h,up:f,ahead:m,half:v}=t,u=t.away/l;r.viewport(0,0,r.drawingBufferWidth,r.drawingBufferHeight);let[g,d,y]=n?[0,0,0]:qe;r.clearColor(g,d,y,1),r.clear(r.COLOR_BUFFER_BIT|r.DEPTH_BUFFER_BIT),r.enable(r.DEPTH_TEST),r.useProgram(a),r.bindVertexArray(this.array),e.texels.forEach(({texture:M},b)=>{r.activeTexture(r.TEXTURE0+b),r.bindTexture(r.TEXTURE_2D,M)});let w=Math.min(e.levels,o)-1,S=e.texels.length>1;r.uniform1i(i.octree,0),r.uniform1i(i.colors,S?1:0),r.uniform1i(i.texels,e.count),r.uniform1i(i.deepest,w),r.uniform1i(i.partial,Number(e.partial&&e.levels<o)),r.uniform1i(i.colored,Number(S)),r.uniform1i(i.bare,Number(n)),r.uniform3fv(i.eye,t.eye.map((M,b)=>(M-c[b])/l));for(let[M,b]of Object.entries({right:h,up:f,ahead:m}))r.uniform3fv(i[M],b);r.uniform2fv(i.lens,v),r.uniform1f(i.near,Math.max(u-this.radius,u/64)/2);for(let[M,b]of Object.entries({key:Ve,fill:ze})){let x=h.map((E,U)=>b[0]*h[U]+b[1]*f[U]-b[2]*m[U]);r.uniform3fv(i[M],x.map(E=>E/Math.hypot(...x)))}r.uniform3fv(i.stone,Xe),r.drawElements(r.TRIANGLES,this.count,this.type,0)}pixels(e,t,n){let o=Math.max(n.away/this.cube.side-this.radius,1e-6);return t/(2*n.half[1]*o)*2**-e}};var C=35*Math.PI/180,ue=.4,_=60,We=.0015,Ye=.05,Ke=20,de={ArrowLeft:[-_,0,0],ArrowRight:[_,0,0],ArrowUp:[0,_,0],ArrowDown:[0,-_,0],Equal:[0,0,-1],NumpadAdd:[0,0,-1],Minus:[0,0,1],NumpadSubtract:[0,0,1]},B=class{#e=new Set;#t=new Map;constructor(e,t,n){this.canvas=e,this.middle=t,this.diameter=n,this.azimuth=25,this.elevation=15,this.distance=0;let[o,r,a=0]=location.hash.slice(1).split(",").map(Number);[o,r,a].every(Number.isFinite)&&this.place(o,r,a),e.focus({preventScroll:!0}),e.addEventListener("pointerdown",i=>{i.button===0&&(e.setPointerCapture(i.pointerId),this.#t.set(i.pointerId,{x:i.clientX,y:i.clientY}))});for(let i of["pointerup","pointercancel"])e.addEventListener(i,c=>this.#t.delete(c.pointerId));e.addEventListener("pointermove",i=>this.#r(i)),e.addEventListener("wheel",i=>{i.preventDefault(),this.#n(Math.exp(i.deltaY*We))},{passive:!1}),e.addEventListener("keydown",i=>{if(i.ctrlKey||i.metaKey||i.altKey)return this.#e.clear();i.code in de&&(i.preventDefault(),this.#e.add(i.code))}),e.addEventListener("keyup",i=>this.#e.delete(i.code)),e.addEventListener("blur",()=>this.#e.clear())}place(e,t,n=0){this.azimuth=e%360,this.elevation=Math.max(-90,Math.min(90,t)),this.distance=n>0?Math.max(Ye,Math.min(Ke,n)):0}step(e){for(let t of this.#e){let[n,o,r]=de[t];this.place(this.azimuth+n*e,this.elevation+o*e,this.distance),r&&this.#n(Math.exp(r*e))}}get camera(){let e=this.canvas.width/this.canvas.height,t=Math.tan(C/2),[n,o]=[this.azimuth,this.elevation].map(f=>f*Math.PI/180),r=[Math.sin(n)*Math.cos(o),Math.sin(o),Math.cos(n)*Math.cos(o)],a=(this.distance||this.#s(e,t))*this.diameter,i=this.middle.map((f,m)=>f+a*r[m]),c=r.map(f=>-f),l=Math.hypot(c[0],c[2]),h=l<1e-9?[1,0,0]:[-c[2]/l,0,c[0]/l];return{eye:i,right:h,up:je(h,c),ahead:c,away:a,half:[t*e,t]}}#s(e,t){return .5/Math.sin(Math.atan(t*Math.min(1,e)))}#n(e){let{width:t,height:n}=this.canvas,o=this.distance||this.#s(t/n,Math.tan(C/2));this.place(this.azimuth,this.elevation,o*e)}#r(e){let t=this.#t.get(e.pointerId);if(!t)return;let n=this.#o(),o={x:e.clientX,y:e.clientY};if(this.#t.set(e.pointerId,o),this.#t.size===1){let[r,a]=[o.x-t.x,o.y-t.y];this.place(this.azimuth-r*ue,this.elevation+a*ue,this.distance)}else n>0&&this.#o()>0&&this.#n(n/this.#o())}#o(){let[e,t]=this.#t.values();return e&&t?Math.hypot(e.x-t.x,e.y-t.y):0}},je=(s,e)=>[s[1]*e[2]-s[2]*e[1],s[2]*e[0]-s[0]*e[2],s[0]*e[1]-s[1]*e[0]];function Je(s){p(s?.format==="ptmtools apo"&&s.schema===1,"not an index of an octree texture");let{cube:e,levels:t,normals:n,colors:o,mesh:r}=s;p(n?.file==="apo.bin"&&(o??{file:"color.bin"}).file==="color.bin","other streams");let a={cube:e,levels:t,streams:o?[n,o]:[n]};return Z(a),p(r?.file==="mesh.glb"&&k(r.crc32,0,4294967295),"no mesh"),{...a,mesh:r}}re(async(s,e,t,n)=>{let o=new URLSearchParams(location.search),r=new URL(e.index,location.href).href,a=x=>new URL(x,r).href,i=await ie(t,r,Je),c=await t.whole(a(i.mesh.file),x=>fe(x,i.mesh.crc32)),l=o.get("update")==="steps"?Math.max(.05,Number(o.get("step"))||.5):0,h=new F(s,i,a,t,l),f=new O(s,c,i.cube),m=s.canvas,v=c.low.map((x,E)=>(x+c.high[E])/2),u=new B(m,v,Math.hypot(...c.high.map((x,E)=>x-c.low[E]))),g=o.has("levels")?Math.max(0,Number(o.get("levels"))||0):1/0,d=o.has("normals"),y=i.streams.reduce((x,{ends:E})=>x+(E.at(-1)??0),0),w=!1,S="",M=0,b=x=>h.levels?D(document,x.message):n(x);return R(document,"#keys").textContent="Drag or use the arrow keys to turn; wheel, two fingers, + and − to zoom",{frame(x){u.step(x);let{camera:E}=u,U=V=>V<g&&(!V||f.pixels(V-1,m.height,E)>1);h.advance(U,b),w=!h.complete&&!U(h.levels);let W=[m.width,m.height,...E.eye,h.updates,h.partial].join();W!==S&&f.draw(h,E,{bare:d,levels:g}),S=W,M=h.levels;let me=h.complete||h.levels>=g?"":w?"; finer ones when you come closer":" …";return`${h.levels} of ${i.levels.length} levels, ${G(h.fetched)} of ${G(y)}${me}`},state:()=>({levels:h.levels,partial:h.partial,complete:h.complete&&M===h.levels,paused:w,updates:h.updates,requests:t.requests,bytes:t.bytes,pending:t.pending,camera:u.camera}),address:()=>`#${[u.azimuth,u.elevation,u.distance].map(x=>Number(x.toFixed(3))).join()}`,look:()=>({eye:u.camera.eye,direction:u.camera.ahead,angle:C}),place:u.place.bind(u)}});
