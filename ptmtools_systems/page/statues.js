var E=class extends Error{constructor(e,t){super(t),this.code=e}};var se=(r,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[r]);var S=se("objects",{relief:"The relief of {name} does not fit the index.",object:"an object",octree:"The index has a wrong octree: {reason}",largeTexture:"This graphics card has no textures of 4,096 texels.",largeImage:"The image is larger than this graphics card's textures.",damaged:"{file} is damaged: {reason}",noSets:"This site has no interlaced images, so you see its own textures.",fixed:"The policy and the comparison are those of other textures than interlaced images."});var re=Promise.resolve();var R=(r,e)=>r.replace(/\{(\w+)\}/g,(t,s)=>e[s]);var k=()=>performance.now()/1e3;var O=(r="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${r}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,P=`
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
}`,ne=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${P}
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
}`,F=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,ie=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${F}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,ae=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${F}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,H={surface:[O(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),ne],item:[O(),ie],placeholder:[O(),ae]};function G(r,e,t=H[e]){let s=r.createProgram(),o=[r.VERTEX_SHADER,r.FRAGMENT_SHADER];if(t.forEach((c,h)=>{let a=r.createShader(o[h]);r.shaderSource(a,c),r.compileShader(a),r.attachShader(s,a),r.deleteShader(a)}),r.linkProgram(s),!r.getProgramParameter(s,r.LINK_STATUS)&&!r.isContextLost())throw new Error(`${e}: ${r.getProgramInfoLog(s)}`);let n={},i=r.isContextLost()?0:r.getProgramParameter(s,r.ACTIVE_UNIFORMS);for(let c=0;c<i;c++){let h=r.getActiveUniform(s,c)?.name??"";n[h]=r.getUniformLocation(s,h)}return{program:s,at:n}}function $(r,{program:e,at:t},s){r.useProgram(e),r.uniform3fv(t.eye,s.eye),r.uniformMatrix3fv(t.turn,!1,s.turn),r.uniform4fv(t.lens,s.lens)}function N(r,e,t,s=0,o=s){let n=0;for(let i=0;i<3;i++){let c=Math.max(e[s+i]-r[i],r[i]-t[o+i],0);n+=c*c}return Math.sqrt(n)}var le=[.5,.7,.6].map(r=>r/Math.hypot(.5,.7,.6)),B=`
float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${le.join()}))) / 2.0;
  return ${.3} + ${1-.3} * along * along;
}`;var ce=Uint32Array.from({length:256},(r,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function V(r,e=0){let t=~e;for(let s=0;s<r.length;s++)t=ce[(t^r[s])&255]^t>>>8;return~t>>>0}var w=4096,z=2**24,he=7,fe=65536,ue=new Uint8Array([3,0]),W=2,de=4;function y(r,e){if(!r)throw new Error(e)}var _=(r,e,t)=>Number.isInteger(r)&&e<=r&&r<=t;function X({cube:r,levels:e,streams:t}){let s=o=>typeof o=="number"&&Math.abs(o)<=1e15;y(Array.isArray(r?.low)&&r.low.length===3&&r.low.every(s),"no cube"),y(s(r.side)&&r.side>=1e-15,"no cube"),y(Array.isArray(e)&&_(e.length,1,21),"no levels"),y(e.every(o=>_(o,1,z)),"a level without texels"),y(e.reduce((o,n)=>o+n,0)<=z,"too many texels");for(let o of t){for(let n of[o?.ends,o?.crc32])y(Array.isArray(n)&&n.length===e.length,"lists of other lengths"),y(n.every(i=>_(i,0,4294967295)),"a list without numbers");y(o.ends.every((n,i)=>n>(i?o.ends[i-1]:W)),"ends that do not ascend")}}var me=64,pe=10,U=(r,e)=>r?r+1:Math.min(he,e),j=r=>typeof r?.code=="string"&&r.code.startsWith("PTM-V"),C=class{rows=0;constructor(e,t){this.gl=e;let s=Math.max(1,Math.ceil(t/w));this.size=4*w*s,this.bytes=new Uint8Array(this.size),this.texture=e.createTexture(),this.#e(()=>{e.texStorage2D(e.TEXTURE_2D,1,e.RGBA8UI,w,s);for(let o of[e.TEXTURE_MIN_FILTER,e.TEXTURE_MAG_FILTER])e.texParameteri(e.TEXTURE_2D,o,e.NEAREST)})}#e(e){let{gl:t}=this;t.activeTexture(t.TEXTURE3),t.bindTexture(t.TEXTURE_2D,this.texture),e(),t.activeTexture(t.TEXTURE0)}upload(e){let{gl:t,bytes:s,rows:o}=this;if(!s)return!0;let n=Math.ceil(e/w),i=Math.min(n,o+me);return this.#e(()=>t.texSubImage2D(t.TEXTURE_2D,0,0,o,w,i-o,t.RGBA_INTEGER,t.UNSIGNED_BYTE,s,4*w*o)),this.rows=Math.min(i,Math.floor(e/w)),i===n}},D=class{#e=[0,0];#t=0;#s=!1;#o=[];constructor(e,t,s,o,n){this.gl=e,this.index=t,this.urlOf=s,this.fetcher=o,this.step=n,this.starts=[0];for(let i of t.levels)this.starts.push((this.starts.at(-1)??0)+i);if(this.count=this.starts.at(-1),e.getParameter(e.MAX_TEXTURE_SIZE)<w)throw new E("PTM-V101",S.largeTexture);this.streams=t.streams,this.texels=this.streams.map(()=>new C(e,this.count)),this.levels=0,this.partial=!1,this.updates=0,this.running=!1,this.restsUntil=0,this.progress=void 0}get complete(){return this.levels===this.index.levels.length}delete(){this.#s=!0;for(let{texture:e}of this.texels)this.gl.deleteTexture(e)}get bytes(){return this.texels.reduce((e,{size:t})=>e+t,0)}get rests(){return k()<this.restsUntil}get fetched(){return this.levels?this.streams.reduce((e,{ends:t})=>e+t[this.levels-1],0):0}advance(e,t,s,o=U(this.levels,this.index.levels.length)){if(!(this.running||this.complete||this.rests||!e(this.levels)))return this.running=!0,this.#n(o).then(()=>s?.(),n=>{this.restsUntil=n.code==="PTM-V104"?k()+pe:1/0,this.#s||t(n)}).finally(()=>this.running=!1)}async#n(e){let t=this.step&&this.levels?setInterval(()=>this.#i(),1e3*this.step):0;try{await Promise.all(this.streams.map((s,o)=>this.#a(o,this.levels,e)))}finally{clearInterval(t),this.partial=!1}for(let s of this.texels)for(;!this.#s&&!s.upload(this.starts[e]);)await new Promise(o=>setTimeout(o,16));if(!this.#s&&(this.updates++,this.levels=e,this.complete))for(let s of this.texels)s.bytes=null}#i(){let e=Math.min(...this.#e.slice(0,this.streams.length));if(!(this.#s||e<=Math.max(this.#t,this.starts[this.levels]))){for(let t of this.texels)for(;!t.upload(e););this.#t=e,this.updates++,this.partial=!0}}async#a(e,t,s){try{await this.#r(e,t,s,"default")}catch(o){if(j(o))throw o;this.#o[e]=null,await this.#r(e,t,s,"no-store").catch(n=>{throw j(n)?n:new E("PTM-V105",R(S.damaged,{file:this.streams[e].file,reason:n.message}))})}}async#r(e,t,s,o){let n=this.streams[e],i=this.texels[e],c=i.bytes,h=t?n.ends[t-1]:W,a=n.ends[s-1]-(s===n.ends.length?de:0),l=new DecompressionStream("deflate-raw"),f=l.writable.getWriter(),d=4*this.starts[s],m=new Map,u=4*this.starts[t],x=t;i.rows=Math.min(i.rows,Math.floor(this.starts[t]/w)),this.#e[e]=this.#t=this.starts[t];let p=(async()=>{for(let g=l.readable.getReader();;){let{done:M,value:T}=await g.read();if(M)return;y(u+T.length<=d,"more texels than the index says"),c.set(T,u);for(let b=0;b<T.length;){let A=4*this.starts[x+1]-u,I=T.subarray(b,b+A);m.set(x,V(I,m.get(x))),b+=I.length,u+=I.length,I.length===A&&x++}this.#e[e]=Math.floor(u/4)}})();p.catch(()=>{});let v=this.step&&t?fe:a-h;for(let g=h;g<a;g+=v){let M=await this.#l(e,g,Math.min(g+v,a),o);await Promise.race([f.write(M),p])}s<n.ends.length&&await Promise.race([f.write(ue),p]),await Promise.all([f.close(),p]),y(u===d,"fewer texels than the index says");for(let g=t;g<s;g++)y(m.get(g)===n.crc32[g],`level ${g} has another checksum`)}async#l(e,t,s,o){let{file:n,ends:i}=this.streams[e],c=i.at(-1),h=this.#o[e];if(!h){let a=await this.fetcher.range(this.urlOf(n),t,s,c,this.progress,o);if(a.begin===t&&a.body.length===s-t)return a.body;h=this.#o[e]=a.body}return h.subarray(t,s)}};var q=`
uniform usampler2D octree;
uniform int texels,deepest;
uniform bool partial;
uvec4 texel(usampler2D of,int address){
return texelFetch(of,ivec2(address % ${w},address/${w}),0);
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
}`;var K=128<<20,ge=.1,we=O(`
uniform vec3 low;
uniform float side;
out vec3 q;`,"q = (position - low) / side;"),xe=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec3 q;
uniform float cutoff;
out vec4 shown;
${P}
${q}
${B}
void main(){
int stop=stopDepth(q);
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(vec3(texel(octree,addressAt(q,stop)).rgb)/127.5-1.0);
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,L=class{#e=[];#t=new Map;#s=new Map;competes=()=>!1;#o=!1;#n=[];constructor(e,t,s,o,n,i){this.gl=e,this.site=s,this.fetcher=o,this.report=n,this.touch=i,this.indices=t.map(c=>{try{let{cube:h,levels:a,file:l,ends:f,crc32:d}=c,m={cube:h,levels:a,streams:[{file:l,ends:f,crc32:d}]};return X(m),m}catch(h){return n(new E("PTM-V105",R(S.octree,{reason:h.message}))),null}}),this.program=G(e,"octree",[we,xe])}delete(){for(let e of this.#e)e?.delete();this.#e=[]}has({octree:e}){return(this.#e[e]?.levels??0)>0}get lacks(){return!this.#o||[...this.#t.keys()].some(e=>this.#a(e))}get levels(){return Array.from(this.#e,e=>e?.levels??0)}get bytes(){return this.#e.reduce((e,t)=>e+(t?.bytes??0),0)}advance(e,t,s,o){this.#t.clear(),this.#s.clear(),this.#o=!0;let n=k(),i=this.gl.drawingBufferWidth*this.gl.drawingBufferHeight;for(let{batches:a}of e)for(let{look:{octree:l,blends:f},low:d,high:m}of a){let u=this.indices[l];if(!u||f)continue;let x=Math.max(ge,N(t,d,m)),p=s/2/x,v=p*u.cube.side;this.#t.set(l,Math.max(v,this.#t.get(l)??0));let[g,M,T]=[0,1,2].map(A=>m[A]-d[A]),b=Math.min(1,p*p*M*Math.max(g,T)/i);this.#s.set(l,Math.max(b,this.#s.get(l)??0)),this.#n[l]=n}if(!o||this.competes()||this.#e.some(a=>a?.running))return;let c=-1,h=0;for(let a of this.#t.keys()){let l=this.#i(a);l>h&&this.#a(a)&&([c,h]=[a,l])}c>=0&&this.load(c)}get wanted(){return[...this.#t].filter(([t])=>this.#a(t)&&!this.#e[t]?.running).map(([t,s])=>{let o=this.#e[t]?.levels??0,n=this.indices[t]?.levels.length??0;return{number:t,levels:o,following:U(o,n),share:this.#s.get(t)??0,finest:Math.min(n,1+Math.ceil(Math.log2(s)))}})}#i(e){let t=this.#e[e]?.levels??0;return(this.#t.get(e)??0)*2**-Math.max(0,t-1)}#a(e){let t=this.#e[e];return t?!t.complete&&!t.rests&&this.#i(e)>1:this.#i(e)>1&&this.#l(e)}#r(e){return 4*(this.indices[e]?.levels.reduce((t,s)=>t+s,0)??0)}#l(e){return[...this.#t.keys()].filter(s=>s!==e&&this.#e[s]).reduce((s,o)=>s+this.#r(o),this.#r(e))<=K}load(e,t,s){let o=this.#e[e],n=this.indices[e];if(n)return o||(this.#c(this.#r(e)),o=new D(this.gl,n,i=>this.site.of(i),this.fetcher,0),this.#e[e]=o),o.progress=s,o.advance(()=>!0,this.report,this.touch,t)}#c(e){let t=[...this.#e.keys()].filter(s=>this.#e[s]&&!this.#t.has(s));for(let s of t.sort((o,n)=>this.#n[o]-this.#n[n])){if(this.bytes+e<=K)return;this.#e[s]?.delete(),delete this.#e[s]}}draw(e,t,s){let{gl:o,program:n}=this,{at:i}=n;$(o,n,e),o.uniform1i(i.octree,3);let c=!1;for(let{buffers:h,batch:a}of t){let l=this.#e[a.look.octree],{cube:{low:f,side:d}}=l.index;o.activeTexture(o.TEXTURE3),o.bindTexture(o.TEXTURE_2D,l.texels[0].texture),o.activeTexture(o.TEXTURE0),o.uniform3fv(i.low,f),o.uniform1f(i.side,d),o.uniform1i(i.texels,l.count),o.uniform1i(i.deepest,l.levels-1),o.uniform1i(i.partial,0),o.bindVertexArray(h.vertexArray),c=s(i,a)||c,h.draw(a)}return c}};function Y(r,e,t,s,o,n,i,c=0){let h=0,a=s;for(let l=s+1;l<=n;l++){c+=r[t+l];let f=c/Math.max(e[t+l]-o,1);c>0&&f>=h&&(h=f,a=l)}i.density=h,i.column=a,i.preview=-1}function Q(r,e){let t=0,s=0;for(let n of e)t+=Math.max(n.left,0),s+=+!n.waits;let o=r.latency+.2/2;return s<r.concurrency&&(t===0||8*t<o*r.bandwidth)}function ee({latency:r,bandwidth:e,concurrency:t}){let s=r>0?r*e/8/t:0;return 300+Math.floor(Math.min(s,1048576))}function Ae(r,e,t){let s={density:0,number:-1,bytes:0,end:0};for(let{number:o,levels:n,following:i,finest:c,share:h}of r){let{ends:a,differences:l}=e[o],f=Float64Array.from(a,(p,v)=>h*Math.max(Number(l?.[v])||0,.5)),d=Float64Array.from(a,(p,v)=>a[Math.max(v+1,i)-1]),m=n?a[n-1]:0,u={density:0,texture:-1,column:0,preview:-1};Y(f,d,-1,n,m-t,c,u);let x=Math.max(u.column,i);u.density>s.density&&(s={density:u.density,number:o,bytes:a[x-1]-m,end:x})}return s}function te(r,e){let{client:t,client:{catalogue:{K:s,ends:o},downloads:n},index:{octrees:i=[]},stream:c}=r,{next:h}=Object.getPrototypeOf(t),a=({kind:l,number:f,begin:d})=>l==="texture"&&d>=o[f*s+Math.max(t.target[f],t.column[f])];e.competes=()=>r.policy==="best"&&!c.rests,t.next=l=>{if(!e.competes()||!r.begun)return h.call(t,l);for(;Q(l,n.waiting);){let f=h.call(t,l),{density:d,number:m,bytes:u,end:x}=Ae(e.wanted,i,ee(l));if(m<0||f&&f.priority>=d&&!a(f))return f;f&&t.failed(f);let p={kind:"octree",number:m,begin:0,end:u,priority:d,left:u};n.waiting.add(p),e.load(m,x,p)?.finally(()=>{n.waiting.delete(p),c.pump()})}return null}}function Vt(r){let{gl:e,index:t,picture:s,stream:{site:o,fetcher:n}}=r,i=new L(e,t.octrees??[],o,n,r.report,()=>s.touch());s.renderer.statues=i,new URLSearchParams(location.search).get("octrees")==="best"&&te(r,i)}export{Vt as show};
