var E=class extends Error{constructor(t,e){super(e),this.code=t}};var R=()=>performance.now()/1e3;var S=(r="",t="")=>`#version 300 es
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
${t}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,D=`
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
}`,J=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${D}
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
}`,Q=`#version 300 es
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
}`,tt=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${F}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,_={surface:[S(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),J],item:[S(),Q],placeholder:[S(),tt]};function L(r,t,e=_[t]){let s=r.createProgram(),o=[r.VERTEX_SHADER,r.FRAGMENT_SHADER];if(e.forEach((h,l)=>{let a=r.createShader(o[l]);r.shaderSource(a,h),r.compileShader(a),r.attachShader(s,a),r.deleteShader(a)}),r.linkProgram(s),!r.getProgramParameter(s,r.LINK_STATUS)&&!r.isContextLost())throw new Error(`${t}: ${r.getProgramInfoLog(s)}`);let i={},n=r.isContextLost()?0:r.getProgramParameter(s,r.ACTIVE_UNIFORMS);for(let h=0;h<n;h++){let l=r.getActiveUniform(s,h)?.name??"";i[l]=r.getUniformLocation(s,l)}return{program:s,at:i}}function C(r,{program:t,at:e},s){r.useProgram(t),r.uniform3fv(e.eye,s.eye),r.uniformMatrix3fv(e.turn,!1,s.turn),r.uniform4fv(e.lens,s.lens)}function I(r,t,e,s=0,o=s){let i=0;for(let n=0;n<3;n++){let h=Math.max(t[s+n]-r[n],r[n]-e[o+n],0);i+=h*h}return Math.sqrt(i)}var et=[.5,.7,.6].map(r=>r/Math.hypot(.5,.7,.6)),B=`
float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${et.join()}))) / 2.0;
  return ${.3} + ${1-.3} * along * along;
}`;var st=Uint32Array.from({length:256},(r,t)=>{for(let e=0;e<8;e++)t=t&1?t>>>1^3988292384:t>>>1;return t});function H(r,t=0){let e=~t;for(let s=0;s<r.length;s++)e=st[(e^r[s])&255]^e>>>8;return~e>>>0}var g=4096,X=2**24,ot=7,rt=65536,it=new Uint8Array([3,0]),q=2,nt=4;function y(r,t){if(!r)throw new Error(t)}var $=(r,t,e)=>Number.isInteger(r)&&t<=r&&r<=e;function z({cube:r,levels:t,streams:e}){let s=o=>typeof o=="number"&&Math.abs(o)<=1e15;y(Array.isArray(r?.low)&&r.low.length===3&&r.low.every(s),"no cube"),y(s(r.side)&&r.side>=1e-15,"no cube"),y(Array.isArray(t)&&$(t.length,1,21),"no levels"),y(t.every(o=>$(o,1,X)),"a level without texels"),y(t.reduce((o,i)=>o+i,0)<=X,"too many texels");for(let o of e){for(let i of[o?.ends,o?.crc32])y(Array.isArray(i)&&i.length===t.length,"lists of other lengths"),y(i.every(n=>$(n,0,4294967295)),"a list without numbers");y(o.ends.every((i,n)=>i>(n?o.ends[n-1]:q)),"ends that do not ascend")}}var at=64,ht=10,P=(r,t)=>r?r+1:Math.min(ot,t),K=r=>typeof r?.code=="string"&&r.code.startsWith("PTM-V"),U=class{rows=0;constructor(t,e){this.gl=t;let s=Math.max(1,Math.ceil(e/g));this.size=4*g*s,this.bytes=new Uint8Array(this.size),this.texture=t.createTexture(),this.#t(()=>{t.texStorage2D(t.TEXTURE_2D,1,t.RGBA8UI,g,s);for(let o of[t.TEXTURE_MIN_FILTER,t.TEXTURE_MAG_FILTER])t.texParameteri(t.TEXTURE_2D,o,t.NEAREST)})}#t(t){let{gl:e}=this;e.activeTexture(e.TEXTURE1),e.bindTexture(e.TEXTURE_2D,this.texture),t(),e.activeTexture(e.TEXTURE0)}upload(t){let{gl:e,bytes:s,rows:o}=this;if(!s)return!0;let i=Math.ceil(t/g),n=Math.min(i,o+at);return this.#t(()=>e.texSubImage2D(e.TEXTURE_2D,0,0,o,g,n-o,e.RGBA_INTEGER,e.UNSIGNED_BYTE,s,4*g*o)),this.rows=Math.min(n,Math.floor(t/g)),n===i}},k=class{#t=[0,0];#e=0;#s=!1;#o=[];constructor(t,e,s,o,i){this.gl=t,this.index=e,this.urlOf=s,this.fetcher=o,this.step=i,this.starts=[0];for(let n of e.levels)this.starts.push((this.starts.at(-1)??0)+n);if(this.count=this.starts.at(-1),t.getParameter(t.MAX_TEXTURE_SIZE)<g)throw new E("PTM-V101","This graphics card has no textures of 4,096 texels.");this.streams=e.streams,this.texels=this.streams.map(()=>new U(t,this.count)),this.levels=0,this.partial=!1,this.updates=0,this.running=!1,this.restsUntil=0,this.progress=void 0}get complete(){return this.levels===this.index.levels.length}delete(){this.#s=!0;for(let{texture:t}of this.texels)this.gl.deleteTexture(t)}get bytes(){return this.texels.reduce((t,{size:e})=>t+e,0)}get rests(){return R()<this.restsUntil}get fetched(){return this.levels?this.streams.reduce((t,{ends:e})=>t+e[this.levels-1],0):0}advance(t,e,s,o=P(this.levels,this.index.levels.length)){if(!(this.running||this.complete||this.rests||!t(this.levels)))return this.running=!0,this.#i(o).then(()=>s?.(),i=>{this.restsUntil=i.code==="PTM-V104"?R()+ht:1/0,this.#s||e(i)}).finally(()=>this.running=!1)}async#i(t){let e=this.step&&this.levels?setInterval(()=>this.#n(),1e3*this.step):0;try{await Promise.all(this.streams.map((s,o)=>this.#a(o,this.levels,t)))}finally{clearInterval(e),this.partial=!1}for(let s of this.texels)for(;!this.#s&&!s.upload(this.starts[t]);)await new Promise(o=>setTimeout(o,16));if(!this.#s&&(this.updates++,this.levels=t,this.complete))for(let s of this.texels)s.bytes=null}#n(){let t=Math.min(...this.#t.slice(0,this.streams.length));if(!(this.#s||t<=Math.max(this.#e,this.starts[this.levels]))){for(let e of this.texels)for(;!e.upload(t););this.#e=t,this.updates++,this.partial=!0}}async#a(t,e,s){try{await this.#r(t,e,s,"default")}catch(o){if(K(o))throw o;this.#o[t]=null,await this.#r(t,e,s,"no-store").catch(i=>{throw K(i)?i:new E("PTM-V105",`${this.streams[t].file} is damaged: ${i.message}`)})}}async#r(t,e,s,o){let i=this.streams[t],n=this.texels[t],h=n.bytes,l=e?i.ends[e-1]:q,a=i.ends[s-1]-(s===i.ends.length?nt:0),c=new DecompressionStream("deflate-raw"),f=c.writable.getWriter(),d=4*this.starts[s],m=new Map,u=4*this.starts[e],x=e;n.rows=Math.min(n.rows,Math.floor(this.starts[e]/g)),this.#t[t]=this.#e=this.starts[e];let p=(async()=>{for(let w=c.readable.getReader();;){let{done:M,value:T}=await w.read();if(M)return;y(u+T.length<=d,"more texels than the index says"),h.set(T,u);for(let b=0;b<T.length;){let A=4*this.starts[x+1]-u,O=T.subarray(b,b+A);m.set(x,H(O,m.get(x))),b+=O.length,u+=O.length,O.length===A&&x++}this.#t[t]=Math.floor(u/4)}})();p.catch(()=>{});let v=this.step&&e?rt:a-l;for(let w=l;w<a;w+=v){let M=await this.#h(t,w,Math.min(w+v,a),o);await Promise.race([f.write(M),p])}s<i.ends.length&&await Promise.race([f.write(it),p]),await Promise.all([f.close(),p]),y(u===d,"fewer texels than the index says");for(let w=e;w<s;w++)y(m.get(w)===i.crc32[w],`level ${w} has another checksum`)}async#h(t,e,s,o){let{file:i,ends:n}=this.streams[t],h=n.at(-1),l=this.#o[t];if(!l){let a=await this.fetcher.range(this.urlOf(i),e,s,h,this.progress,o);if(a.begin===e&&a.body.length===s-e)return a.body;l=this.#o[t]=a.body}return l.subarray(e,s)}};var G=`
uniform usampler2D octree;
uniform int texels,deepest;
uniform bool partial;
uvec4 texel(usampler2D of,int address){
return texelFetch(of,ivec2(address % ${g},address/${g}),0);
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
}`;var V=128<<20,ct=.1,lt=S(`
uniform vec3 low;
uniform float side;
out vec3 q;`,"q = (position - low) / side;"),ft=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec3 q;
uniform float cutoff;
out vec4 shown;
${D}
${G}
${B}
void main(){
int stop=stopDepth(q);
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(vec3(texel(octree,addressAt(q,stop)).rgb)/127.5-1.0);
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,N=class{#t=[];#e=new Map;#s=new Map;competes=()=>!1;#o=!1;#i=[];constructor(t,e,s,o,i,n){this.gl=t,this.site=s,this.fetcher=o,this.report=i,this.touch=n,this.indices=e.map(h=>{try{let{cube:l,levels:a,file:c,ends:f,crc32:d}=h,m={cube:l,levels:a,streams:[{file:c,ends:f,crc32:d}]};return z(m),m}catch(l){return i(new E("PTM-V105",`The index has a wrong octree: ${l.message}`)),null}}),this.program=L(t,"octree",[lt,ft])}delete(){for(let t of this.#t)t?.delete();this.#t=[]}has({octree:t}){return(this.#t[t]?.levels??0)>0}get lacks(){return!this.#o||[...this.#e.keys()].some(t=>this.#a(t))}get levels(){return Array.from(this.#t,t=>t?.levels??0)}get bytes(){return this.#t.reduce((t,e)=>t+(e?.bytes??0),0)}advance(t,e,s,o){this.#e.clear(),this.#s.clear(),this.#o=!0;let i=R(),n=this.gl.drawingBufferWidth*this.gl.drawingBufferHeight;for(let{batches:a}of t)for(let{look:{octree:c,blends:f},low:d,high:m}of a){let u=this.indices[c];if(!u||f)continue;let x=Math.max(ct,I(e,d,m)),p=s/2/x,v=p*u.cube.side;this.#e.set(c,Math.max(v,this.#e.get(c)??0));let[w,M,T]=[0,1,2].map(A=>m[A]-d[A]),b=Math.min(1,p*p*M*Math.max(w,T)/n);this.#s.set(c,Math.max(b,this.#s.get(c)??0)),this.#i[c]=i}if(!o||this.competes()||this.#t.some(a=>a?.running))return;let h=-1,l=0;for(let a of this.#e.keys()){let c=this.#n(a);c>l&&this.#a(a)&&([h,l]=[a,c])}h>=0&&this.load(h)}get wanted(){return[...this.#e].filter(([e])=>this.#a(e)&&!this.#t[e]?.running).map(([e,s])=>{let o=this.#t[e]?.levels??0,i=this.indices[e]?.levels.length??0;return{number:e,levels:o,following:P(o,i),share:this.#s.get(e)??0,finest:Math.min(i,1+Math.ceil(Math.log2(s)))}})}#n(t){let e=this.#t[t]?.levels??0;return(this.#e.get(t)??0)*2**-Math.max(0,e-1)}#a(t){let e=this.#t[t];return e?!e.complete&&!e.rests&&this.#n(t)>1:this.#n(t)>1&&this.#h(t)}#r(t){return 4*(this.indices[t]?.levels.reduce((e,s)=>e+s,0)??0)}#h(t){return[...this.#e.keys()].filter(s=>s!==t&&this.#t[s]).reduce((s,o)=>s+this.#r(o),this.#r(t))<=V}load(t,e,s){let o=this.#t[t],i=this.indices[t];if(i)return o||(this.#c(this.#r(t)),o=new k(this.gl,i,n=>this.site.of(n),this.fetcher,0),this.#t[t]=o),o.progress=s,o.advance(()=>!0,this.report,this.touch,e)}#c(t){let e=[...this.#t.keys()].filter(s=>this.#t[s]&&!this.#e.has(s));for(let s of e.sort((o,i)=>this.#i[o]-this.#i[i])){if(this.bytes+t<=V)return;this.#t[s]?.delete(),delete this.#t[s]}}draw(t,e,s){let{gl:o,program:i}=this,{at:n}=i;C(o,i,t),o.uniform1i(n.octree,1);let h=!1;for(let{buffers:l,batch:a}of e){let c=this.#t[a.look.octree],{cube:{low:f,side:d}}=c.index;o.activeTexture(o.TEXTURE1),o.bindTexture(o.TEXTURE_2D,c.texels[0].texture),o.activeTexture(o.TEXTURE0),o.uniform3fv(n.low,f),o.uniform1f(n.side,d),o.uniform1i(n.texels,c.count),o.uniform1i(n.deepest,c.levels-1),o.uniform1i(n.partial,0),o.bindVertexArray(l.vertexArray),h=s(n,a)||h,l.draw(a)}return h}};function j(r,t,e,s,o,i,n,h=0){let l=0,a=s;for(let c=s+1;c<=i;c++){h+=r[e+c];let f=h/Math.max(t[e+c]-o,1);h>0&&f>=l&&(l=f,a=c)}n.density=l,n.column=a,n.preview=-1}var pt=.2;var wt=2**20;function W(r,t){let e=0,s=0;for(let i of t)e+=Math.max(i.left,0),s+=+!i.waits;let o=r.latency+pt/2;return s<r.concurrency&&(e===0||8*e<o*r.bandwidth)}function Y({latency:r,bandwidth:t,concurrency:e}){let s=r>0?r*t/8/e:0;return 300+Math.floor(Math.min(s,wt))}var gt=.5;function xt(r,t,e){let s={density:0,number:-1,bytes:0,end:0};for(let{number:o,levels:i,following:n,finest:h,share:l}of r){let{ends:a,differences:c}=t[o],f=Float64Array.from(a,(p,v)=>l*Math.max(Number(c?.[v])||0,gt)),d=Float64Array.from(a,(p,v)=>a[Math.max(v+1,n)-1]),m=i?a[i-1]:0,u={density:0,texture:-1,column:0,preview:-1};j(f,d,-1,i,m-e,h,u);let x=Math.max(u.column,n);u.density>s.density&&(s={density:u.density,number:o,bytes:a[x-1]-m,end:x})}return s}function Z(r,t){let{client:e,client:{catalogue:{K:s,ends:o},downloads:i},index:{octrees:n=[]},stream:h}=r,{next:l}=Object.getPrototypeOf(e),a=({kind:c,number:f,begin:d})=>c==="texture"&&d>=o[f*s+Math.max(e.target[f],e.column[f])];t.competes=()=>r.policy==="best"&&!h.rests(),e.next=c=>{if(!t.competes()||!r.begun)return l.call(e,c);for(;W(c,i.waiting);){let f=l.call(e,c),{density:d,number:m,bytes:u,end:x}=xt(t.wanted,n,Y(c));if(m<0||f&&f.priority>=d&&!a(f))return f;f&&e.failed(f);let p={kind:"octree",number:m,begin:0,end:u,priority:d,left:u};i.waiting.add(p),t.load(m,x,p)?.finally(()=>{i.waiting.delete(p),h.pump()})}return null}}function pe(r,t){let{gl:e,index:s,site:o,fetcher:i,renderer:n}=r;if(!n)return;let h=new N(e,s.octrees??[],o,i,t,()=>r.touch());n.statues=h,new URLSearchParams(location.search).get("octrees")==="best"&&Z(r,h)}export{pe as show};
